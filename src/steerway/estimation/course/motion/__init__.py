"""Motion models: one file each, chosen by `models`, over the arrays of `layout`."""
