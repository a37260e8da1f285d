"""Check for another distribution that installs a package of the same name.

Other distributions also install a package called ``perception``, and installers overwrite files of
one with files of the other without a warning. Each of our packages imports this module first. The
import line also marks an ``__init__.py`` as ours, so that it can be recognised without running it.
"""

from __future__ import annotations

from importlib.machinery import all_suffixes
from importlib.util import find_spec
from pathlib import Path
from runpy import run_path

# Each package needs those before it.
_PACKAGES = ("perception", "tracking", "nav_adapter", "awarenav", "sim_tests")
_MARKER = b"_clash"
_SITE = Path(__file__).parents[1]


def require_sole_owner(package: str) -> None:
    """Check that ``package``, and each of our packages that it needs, has no foreign files.

    Without a clash only our own metadata are read. A checkout or an editable install has no list of
    its files; there, only a foreign ``__init__.py`` is found. A foreign package that consisted of
    nothing but an ``__init__.py`` which ours overwrote cannot be found.

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
        place = init.parent if init.stem == "__init__" else init  # or a module perception.py
        owners = _other_owners(place) if not ours or _has_strange_modules(place) else []
        if not ours or owners:
            raise ImportError(_message(name, place, owners), name=name, path=spec.origin)


def _has_strange_modules(folder: Path) -> bool:
    """Return True if ``folder`` has modules that our own installation record does not list."""
    records = list(_SITE.glob("awarenav-*.dist-info/RECORD"))
    if folder.parent != _SITE or not records:
        return False
    lines = [line for path in records for line in path.read_text(encoding="utf-8").splitlines()]
    ours = [line.split(",")[0].split("/") for line in lines if line.startswith(f"{folder.name}/")]
    known = {"__pycache__", *(parts[1] for parts in ours)}
    importable = ("", *all_suffixes())  # folders and modules; data files do no harm
    strange = (entry for entry in folder.iterdir() if entry.name not in known)
    return any("".join(entry.suffixes) in importable for entry in strange)


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
