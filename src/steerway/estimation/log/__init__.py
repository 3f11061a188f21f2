"""Records: what receivers do to them, how late and how accurate they are, and how two of them agree."""
