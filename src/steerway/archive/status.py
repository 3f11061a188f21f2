"""What an archive was made of, and how far it is."""

from pathlib import Path
from typing import Any

from steerway.archive.levels import profile_names
from steerway.archive.running import chains
from steerway.archive.store import Store, date_of


def status(directory: str | Path) -> dict[str, Any]:
    """Settings, inputs and progress, as words and numbers. Raises InputError where there is no archive."""
    store = Store.opened(directory)
    manifest = store.manifest()
    done, todo = sorted(store.done()), sum(map(len, chains(store, manifest)))
    numbers = [store.numbers(*unit) for unit in done]
    days = sorted({day for day, _ in store.staged_units()})
    settings = [f"{manifest['buckets']} bucket{'' if manifest['buckets'] == 1 else 's'}", profile_names(manifest)]
    settings += ["smoothed"] if manifest["smooth"] else []
    settings += [f"{manifest['rate']:g} Hz"] if manifest["rate"] else []
    settings += [f"aided by {', '.join(manifest['aid'])}"] if manifest["aid"] else []
    return {
        "settings": ", ".join(settings),
        "inputs": len(manifest["inputs"]),
        "days": f"{date_of(days[0])} to {date_of(days[-1])}, {len(days)}" if days else "none",
        "units": f"{len(done)} done, {todo} to be done",
        "done": len(done),
        "to_do": todo,
        "rows": sum(each["rows"] for each in numbers),
        "reports": sum(each["reports"] for each in numbers),
        "files": [
            {"input": path} | {name: each[name] for name in ("rows", "left_out", "vessels")}
            for path, each in manifest["inputs"].items()
        ],
    }
