"""Conclusions from the numbers."""

from steerway_studies.estimator_limits.cells import CELLS, WHAT
from steerway_studies.estimator_limits.held import CHANGES

LEAD = (
    "A small craft (O, 1.3 m/s) and a ship (M, 7.7 m/s) alternate straight legs and turns, as the filter's own "
    "model has it, with fixes of 0.5 and 2.5 m at 5 Hz. Errors are RMS over many voyages, in most rows over the "
    "Cramér–Rao bound of an estimator that knows when turns begin and end; in brackets are 95 % intervals over "
    "the voyages."
)


def remarks(numbers) -> list[str]:
    """A paragraph each."""
    return [_modes(numbers), _doubts(numbers), _held(numbers), _form(numbers), *_PLAIN]


def _modes(numbers):
    causal = _both(numbers, "particles_{}_cog_straight_ratio", _SLOW)
    walked = _both(numbers, "histories_{}_cog_straight_ratio", _SLOW)
    turns = _both(numbers, "histories_{}_cog_turn_ratio", _SLOW)
    known = _span(numbers, [f"known_{name}_cog_{where}_ratio" for name in _SLOW for where in ("straight", "turn")])
    ours = _both(numbers, "smoothed_{}_cog_straight_ratio", _SLOW)
    ours_in_turns = _both(numbers, "smoothed_{}_cog_turn_ratio", _SLOW)
    return (
        f"The bound belongs to an estimator that knows when turns begin and end. Straight ahead in O, whoever has to "
        f"find out pays: COG errs by {causal} times its bound (0.5 and 2.5 m) in a filter of a thousand histories, by "
        f"{walked} times in a smoother that weighs all histories; in turns that has {turns}. The smoother that knows "
        f"the modes has {known}. The product's smoother has {ours} straight, {ours_in_turns} in turns: where it has "
        f"what the smoother by all histories has, nothing is left to gain."
    )


def _doubts(numbers):
    def nees(who, where):
        return _span(numbers, [f"{who}{name}_nees_{where}" for name in CELLS])

    covered = _span(numbers, [f"{name}_cog_all_coverage_pct" for name in CELLS], ".0f")
    straight = _both(numbers, "{}_cog_straight_coverage_pct", _SLOW, ".0f")
    turn = _both(numbers, "{}_cog_turn_coverage_pct", _SLOW, ".0f")
    return (
        f"NEES, with an expectation of 3, is {nees('', 'all')} all along. Taken apart it cannot be 3: the filter does "
        f"not know which it is in, so that its covariance is too large on straight legs ({nees('', 'straight')}) and "
        f"too small in the first seconds of a turn ({nees('', 'turn')}). So does the filter of many histories "
        f"({nees('particles_', 'straight')} and {nees('particles_', 'turn')}). With known modes the filter has "
        f"{nees('known_filter_', 'straight')} straight and {nees('known_filter_', 'turn')} in turns: what is missing "
        f"is knowledge of the mode, not a better covariance. For a user: the 95 % interval of COG holds the truth "
        f"in {covered} % of all rows; in O in {straight} % of those straight and {turn} % of those in turns."
    )


def _held(numbers):
    worst = max(numbers[f"held_{change}_{what}_all_worst_pct"] for change in CHANGES for what in WHAT)

    def costs(change, what):
        keys = [f"held_{who}{name}_{change}_{what}_straight_pct" for name in _SLOW for who in ("", "particles_")]
        return "{:.0f} and {:.0f} % (0.5 m), {:.0f} and {:.0f} % (2.5 m)".format(*(numbers[key] for key in keys))

    return (
        f"Parameters held three times off cost at most {worst:.0f} % all along, which is what tuning aims at. Straight "
        f"ahead alone the known ones can be worth more, since who knows that turns are rare or mild may trust a held "
        f"course longer. That is for the most part the price of wrong numbers, whoever uses them: product and "
        f"filter of 300 histories pay, straight ahead in O, {costs('dwell_x3', 'cog')} of COG for dwell times × 3, "
        f"and {costs('density_d3', 'rate')} of course rate for densities ÷ 3."
    )


def _form(numbers):
    def costs(kind, what, where):
        keys = [f"textbook_{kind}_{name}_{what}_{where}_pct" for name in _SLOW]
        return " and ".join(f"{numbers[key]:.0f} %" for key in keys)

    return (
        f"The invariant form of a correction matters where turns are sharp: the textbook's form attributes an error "
        f"of the course to the speed. Without it SOG errs, in turns in O (0.5 and 2.5 m), by "
        f"{costs('known', 'sog', 'turn')} more with known modes, by {costs('weighing', 'sog', 'turn')} if they are "
        f"weighed, by {costs('one_model', 'sog', 'turn')} in a filter of one motion model; COG straight by "
        f"{costs('weighing', 'cog', 'straight')} if modes are weighed. In M, where turns are slow, it does nothing; of "
        f"a course known to 60° at first, what it does in a minute is little beside the spread of the voyages. The "
        f"product has it in the filter of two motion models; the plain five states, where it would serve SOG as "
        f"well, stay Table 1 of P0."
    )


_SLOW = ("o05", "o25")
_PLAIN = [
    "P1's ship counts as straight while its course changes by less than 1° a minute; a table has other limits. The "
    "printed filter has P1's tuning (α1 = 1e-5, α2 = 0.2 1/s). P1's receiver has no white noise but a random walk; as "
    "it comes, motion and receiver are fitted together to the voyage itself.",
    "Intervals are over runs, since the rows of a run err alike.",
]


def _both(numbers, key, names, form=".2f"):
    return " and ".join(format(numbers[key.format(name)], form) for name in names)


def _span(numbers, keys, form=".2f"):
    """Least to greatest."""
    values = [numbers[key] for key in keys]
    least, greatest = format(min(values), form), format(max(values), form)
    return least if least == greatest else f"{least} to {greatest}"
