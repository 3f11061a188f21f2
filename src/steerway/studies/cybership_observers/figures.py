def all_figures(first_seed, numbers, table):
    return {}
