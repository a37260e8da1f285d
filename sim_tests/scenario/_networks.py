"""Networks of one's own for the pictures of a crossing, identified by the contents of their files.

The choice is that of ``awarenav estimate``, so the networks that drive a robot also drive the
simulated one. It is kept in the scenario, as are camera and robot.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from pydantic import ValidationError

from awarenav.errors import AwarenavError
from perception.documents import parse_yaml, yaml_text
from perception.errors import PerceptionError
from tracking.config import complaints

from ..world.errors import SimError

if TYPE_CHECKING:
    from perception.named import Networks

_SHIPPED: Final = "shipped"
_CHECKSUMS: Final = "sha256"
# A detector of photographs costs a computer on a robot most of the time between two images, so it
# does not look at each of them there. The shipped one does.
_DETECT_EVERY_S: Final = 0.15


def networks_data(named: str | Path) -> dict[str, Any]:
    """Return the keys of a scenario's ``networks``, from a set or file as for ``--networks``.

    The paths of files are absolute, and each network that is a file has its checksum, so that
    the keys give the same networks in every process, or none.
    """
    # Only crossings with networks of one's own need the modules that run them.
    from perception.named import NetworkChoice  # noqa: PLC0415

    try:
        data = NetworkChoice.of(named).model_dump(exclude_defaults=True)
    except AwarenavError as error:
        raise SimError(str(error)) from error
    try:
        data = {key: _absolute(value) for key, value in data.items()}
        if checksums := _checksums(data):
            data[_CHECKSUMS] = checksums
        load_networks(yaml_text(data))
    except AwarenavError as error:
        raise SimError(f"{named}: {error}") from error
    return data


@lru_cache(maxsize=4)
def load_networks(text: str) -> Networks:
    """Load the networks of a scenario, once in a process."""
    from perception.named import NetworkChoice  # noqa: PLC0415
    from perception.networks import OnnxSettings  # noqa: PLC0415

    data = parse_yaml(text, "networks", SimError)
    expected = data.pop(_CHECKSUMS, {})
    try:
        choice = NetworkChoice(**data)
        for role, found in _checksums(data).items():
            if found != expected.get(role, found):
                raise SimError(
                    f"{role} {data[role]} has changed: its sha256 is {found}, expected "
                    f"{expected[role]}"
                )
        return choice.load(
            # An episode runs on one core, often beside others, and is the same everywhere.
            settings=OnnxSettings(intra_op_threads=1),
            detect_every_s=0.0 if choice.detector == _SHIPPED else _DETECT_EVERY_S,
        )
    except ValidationError as error:
        raise SimError(f"networks: {complaints(error)}") from error
    except (AwarenavError, PerceptionError) as error:
        raise SimError(str(error)) from error


def _absolute(value: Any) -> Any:
    """Return the value of a key with an absolute path, where it names a file."""
    found = _file_in(value)
    return value if found is None else f"{found[0]}{found[1].resolve()}"


def _checksums(data: Mapping[str, Any]) -> dict[str, str]:
    """Return the sha256 of each network that is a file, by its role."""
    from perception.named import NetworkFolder  # noqa: PLC0415

    store = NetworkFolder()
    fetched = {each.name for each in store.catalogue.models}
    found = {}
    for role, value in data.items():
        named = ("", store.path(value)) if value in fetched else _file_in(value)
        if named is not None:
            found[role] = hashlib.sha256(named[1].read_bytes()).hexdigest()
    return found


def _file_in(value: Any) -> tuple[str, Path] | None:
    """Return the file that a value names, after ``FAMILY:`` or nothing; None for no file."""
    if not isinstance(value, str) or value == _SHIPPED:
        return None
    family, colon, file = value.partition(":")
    for prefix, name in (("", value), (family + colon, file)):
        if name and Path(name).is_file():
            return prefix, Path(name)
    return None
