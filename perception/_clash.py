"""Check for another distribution that installs a package of the same name.

Other distributions also install a package called ``perception``, and installers overwrite files of
one with files of the other without a warning. Each of our packages imports this module first. The
import line also marks an ``__init__.py`` as ours, so that it can be recognised without running it.
"""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from runpy import run_path

# Each package needs those before it.
_PACKAGES = ("perception", "tracking", "nav_adapter", "awarenav", "sim_tests")
_MARKER = b"_clash"
_SITE = Path(__file__).parents[1]


def require_sole_owner(package: str) -> None:
    """Check that ``package``, and each of our packages that it needs, is ours.

    A foreign package is recognised by its ``__init__.py``; its other files do no harm.

    Raises:
        ImportError: for a clash; the message names the other distribution, or the path if no
            distribution lists it, and the remedy.
    """
    for name in _PACKAGES[: _PACKAGES.index(package) + 1]:
        spec = find_spec(name)
        if spec is None or spec.origin is None:
            raise ImportError(
                f"awarenav's {name}/__init__.py is missing from {_SITE / name}, as happens when "
                "another distribution with a package of that name is uninstalled. "
                f"Put it back: {_reinstall_command()}",
                name=name,
            )
        init = Path(spec.origin)
        try:
            ours = _MARKER in init.read_bytes()
        except OSError:  # in a zip file or a frozen program, which no installer changes
            continue
        if not ours:
            place = init.parent if init.stem == "__init__" else init  # or a module perception.py
            raise ImportError(
                _message(name, place, _other_owners(place)), name=name, path=spec.origin
            )


def _other_owners(folder: Path) -> list[str]:
    """Return other distributions that list files under ``folder``, as "name version"."""
    from importlib import metadata  # noqa: PLC0415 - takes 20 ms and is only needed for a clash

    return sorted(
        {
            f"{found.metadata['Name']} {found.version}"
            for found in metadata.distributions()
            if str(found.metadata["Name"]).lower() != "awarenav"
            and any(file.parts[:1] == (folder.name,) for file in found.files or ())
            and Path(str(found.locate_file(folder.name))).resolve() == folder.resolve()
        }
    )


def _message(name: str, place: Path, owners: list[str]) -> str:
    others = ", ".join(owners) or f"an unknown distribution at {place}"
    removal = f"take {place} off the import path"
    if owners:
        removal = f"pip uninstall {' '.join(owner.split()[0] for owner in owners)}"
    return (
        f"awarenav needs the import name {name!r} to itself, but {place} belongs, all or in part, "
        f"to: {others}. Keep the two in separate virtual environments; or remove the other "
        f"({removal}), then: {_reinstall_command()}"
    )


def _reinstall_command() -> str:
    # By path, as this module is run: the package may not be ours, or only in part.
    found = run_path(str(Path(__file__).with_name("installation.py")))
    return str(found["reinstall_command"]())


require_sole_owner("perception")
