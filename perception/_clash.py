"""Reports a clash of import names, naming the distribution that causes it.

Other distributions install a package called ``perception`` too, and installers let one overwrite
another's files without a word. Each of our packages runs this file first; the line that does
so also tells our own ``__init__.py`` from a foreign one, without running either.
"""

from __future__ import annotations

from importlib.machinery import all_suffixes
from importlib.util import find_spec
from pathlib import Path

# Each needs those before it.
_PACKAGES = ("perception", "tracking", "nav_adapter", "awarenav", "sim_tests")
_MARKER = b"_clash"
_SITE = Path(__file__).parents[1]


def require_sole_owner(package: str) -> None:
    """Check that ``package``, and each of our packages that it needs, is ours alone.

    The good case reads no metadata but our own. A checkout or an editable install has no record of
    its files: there, only a foreign ``__init__.py`` is noticed. A foreign package that was nothing
    but the ``__init__.py`` that ours overwrote left no trace, and goes unnoticed.

    Raises:
        ImportError: naming the other distribution, or the path when none claims it, and the remedy.
    """
    for name in _PACKAGES[: _PACKAGES.index(package) + 1]:
        spec = find_spec(name)
        if spec is None or spec.origin is None:
            raise ImportError(
                f"awarenav's {name}/__init__.py is missing from {_SITE / name}, as happens when "
                "another distribution with a package of that name is uninstalled. "
                "Put it back: pip install --force-reinstall --no-deps awarenav",
                name=name,
            )
        init = Path(spec.origin)
        try:
            ours = _MARKER in init.read_bytes()
        except OSError:  # inside a zip file or a frozen program: no installer mixes those
            continue
        place = init.parent if init.stem == "__init__" else init  # or a lone perception.py
        owners = _other_owners(place) if not ours or _has_strange_modules(place) else []
        if not ours or owners:
            raise ImportError(_message(name, place, owners), name=name, path=spec.origin)


def _has_strange_modules(folder: Path) -> bool:
    """Whether ``folder`` holds modules that our own installation record does not list."""
    records = list(_SITE.glob("awarenav-*.dist-info/RECORD"))
    if folder.parent != _SITE or not records:
        return False
    lines = [line for path in records for line in path.read_text(encoding="utf-8").splitlines()]
    ours = [line.split(",")[0].split("/") for line in lines if line.startswith(f"{folder.name}/")]
    known = {"__pycache__", *(parts[1] for parts in ours)}
    importable = ("", *all_suffixes())  # a folder, or a module; data files are nobody's harm
    strange = (entry for entry in folder.iterdir() if entry.name not in known)
    return any("".join(entry.suffixes) in importable for entry in strange)


def _other_owners(folder: Path) -> list[str]:
    """Distributions other than ours that list files under ``folder``, as "name version"."""
    from importlib import metadata  # noqa: PLC0415 - takes 20 ms, and only when all is not well

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
        f"({removal}), then: pip install --force-reinstall --no-deps awarenav"
    )


require_sole_owner("perception")
