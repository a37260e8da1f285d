"""The catalogue of networks for a real robot."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar, Final, Literal

from pydantic import Field, field_validator, model_validator

from perception.shipped import TrainingDomain
from tracking.config import StrictConfig

from ..errors import AwarenavError, not_one_of

Role = Literal["detector", "pose", "face", "head"]

_FILE: Final = Path(__file__).parent / "catalogue.yaml"


class RealModel(StrictConfig):
    """A network that ``awarenav models fetch`` gets from its publisher's address."""

    #: Name on the command line.
    name: str = Field(pattern=r"^[a-z0-9]+(-[a-z0-9]+)*$")
    role: Role
    #: Address of the ONNX file, or of the ZIP archive that holds it.
    url: str = Field(pattern=r"^https?://")
    #: Path of the ONNX file in the archive, or the end of it; None if the address is the file.
    member: str | None = None
    #: Of the ONNX file, also if it comes in an archive.
    sha256: str = Field(pattern=r"^[0-9a-f]{64}$")
    #: Of the ONNX file, approximately.
    size_mb: float = Field(gt=0.0)
    licence: str
    publisher: str
    purpose: str
    #: What it has seen in training.
    training_domain: TrainingDomain = "photographs"
    note: str | None = None
    #: Of a detector: detections with a lower score are dropped; None for the default.
    score_threshold: float | None = Field(None, ge=0.0, le=1.0)

    @property
    def file(self) -> str:
        """Name of the fetched file."""
        return f"{self.name}.onnx"

    @field_validator("licence")
    @classmethod
    def _no_copyleft(cls, value: str) -> str:
        if "GPL" in value.upper():
            raise ValueError(f"{value} networks are named under 'elsewhere', not fetched")
        return value

    @model_validator(mode="after")
    def _member_of_an_archive(self) -> RealModel:
        if (self.member is not None) != self.url.endswith(".zip"):
            raise ValueError(f"{self.name}: 'member' goes with an address that ends in .zip")
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
    purpose: str

    @property
    def file(self) -> str:
        """Name of the file for ``--networks``."""
        return f"{self.name}_networks.yaml"


class Catalogue(StrictConfig):
    """All networks for a real robot, with unique names."""

    error: ClassVar[type[ValueError]] = AwarenavError

    models: tuple[RealModel, ...]
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
            if (roles.get(each.detector), roles.get(each.pose)) != ("detector", "pose"):
                raise ValueError(
                    f"set {each.name}: detector and pose must name networks of these roles, got "
                    f"{each.detector} and {each.pose}"
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
        raise AwarenavError(not_one_of("model", name, [model.name for model in self.models]))
