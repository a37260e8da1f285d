"""An import-linter contract that keeps private modules private.

A module whose name begins with an underscore belongs to the package around it. Modules outside of
that package import from the package's page, its ``__init__``.
"""

from __future__ import annotations

from grimp import ImportGraph
from importlinter import Contract, ContractCheck, fields, output


class PagesContract(Contract):
    """No module imports a private module of a package that it is not in.

    Options:
        packages: top-level packages whose modules are checked as importers.
    """

    type_name = "pages"

    packages = fields.ListField(subfield=fields.StringField())

    def check(self, graph: ImportGraph, verbose: bool) -> ContractCheck:
        """Find imports across a package's border."""
        importers = [
            module
            for module in sorted(graph.modules)
            if any(_inside(module, package) for package in self.packages)
        ]
        offences = [
            (importer, imported)
            for importer in importers
            for imported in sorted(graph.find_modules_directly_imported_by(importer))
            if (home := private_home(imported)) is not None and not _inside(importer, home)
        ]
        return ContractCheck(kept=not offences, metadata={"offences": offences})

    def render_broken_contract(self, check: ContractCheck) -> None:
        """List the imports and where they should come from."""
        for importer, imported in check.metadata["offences"]:
            output.print_error(
                f"{importer} imports {imported}: import from {private_home(imported)} instead",
                bold=False,
            )


def private_home(module: str) -> str | None:
    """Return the package that a private module belongs to; None for a public module."""
    parts = module.split(".")
    for depth, part in enumerate(parts):
        if depth and part.startswith("_") and not part.startswith("__"):
            return ".".join(parts[:depth])
    return None


def _inside(module: str, package: str) -> bool:
    return module == package or module.startswith(f"{package}.")
