"""The choice of networks for pictures, and the refusal of those that have seen none such."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from .._manifest import simulator_networks, simulator_networks_warning
from ..config import StrictConfig
from ..errors import AwarenavError, PerceptionError, not_one_of
from ..networks import OnnxSettings
from ._catalogue import DEFAULT_SET, RealModel
from ._folder import NetworkFolder
from ._load import EYES, HEADS, NONE, SHIPPED, Networks, catalogued, choose_networks


class NetworkChoice(StrictConfig):
    """The networks by name, as those of ``--networks``.

    Attributes:
        detector: as :func:`choose_networks` takes it; so are the others.
        pose: pose network.
        head: head pose.
        face: network of faces.
        small_face: network of faces too small for that one.
        eyes: eyes of near people.
        person_class: of the detector.
        input_size: of the detector.
    """

    error: ClassVar[type[ValueError]] = AwarenavError

    detector: str = SHIPPED
    pose: str = SHIPPED
    head: str = HEADS[0]
    face: str = NONE
    small_face: str = NONE
    eyes: str = EYES[0]
    person_class: int | None = None
    input_size: str | None = None

    @classmethod
    def of(cls, named: str | Path) -> NetworkChoice:
        """Return the networks of a set, by its name in the catalogue, or of a YAML file.

        Raises:
            AwarenavError: for a name of neither, for a set that is not fetched, and for a file
                that cannot be read.
        """
        folder = NetworkFolder()
        sets = {each.name: each for each in folder.catalogue.sets}
        if str(named) in sets:
            chosen = sets[str(named)]
            if not all(map(folder.is_fetched, chosen.networks.values())):
                where = f"the set {named} is not in {folder.folder}"
                raise AwarenavError(f"{where}: awarenav models fetch {named}")
            return cls(**chosen.model_dump(include=set(cls.model_fields), exclude_none=True))
        if not Path(named).suffix and not Path(named).exists():
            what = not_one_of("set of networks", str(named), sets, or_else="a YAML file")
            raise AwarenavError(what)
        return cls.from_yaml(named)

    @classmethod
    def default(cls, *, simulator: bool) -> NetworkChoice:
        """Return the networks that pictures get where nothing else is named.

        They are those of the set ``real``, if that has been fetched completely; else the shipped
        ones, which :func:`admit_networks` refuses outside the simulator.

        Args:
            simulator: the pictures are renders of this package, or count as such; they get the
                shipped networks.
        """
        folder = NetworkFolder()
        sets = () if simulator else folder.catalogue.sets
        members = [each.networks.values() for each in sets if each.name == DEFAULT_SET]
        fetched = any(all(map(folder.is_fetched, names)) for names in members)
        return cls.of(DEFAULT_SET) if fetched else cls()

    def load(
        self,
        *,
        settings: OnnxSettings | None = None,
        min_score: float | None = None,
        detect_every_s: float = 0.0,
    ) -> Networks:
        """Load the networks; arguments and errors as in :func:`choose_networks`."""
        return choose_networks(
            **self.model_dump(),
            settings=settings,
            min_score=min_score,
            detect_every_s=detect_every_s,
        )

    def catalogued(self) -> dict[str, RealModel]:
        """Return what the catalogue says of the networks, by their roles.

        A file is known by its SHA-256. A network that is not in the catalogue is left out.
        """
        named = self.model_dump(exclude_none=True)
        found = {role: catalogued(str(name)) for role, name in named.items()}
        return {role: model for role, model in found.items() if model is not None}


def default_networks(*, simulator_networks: bool, settings: OnnxSettings | None = None) -> Networks:
    """Load the networks that pictures get where no others are given.

    Args:
        simulator_networks: take the shipped networks, for renders of this package.
        settings: providers and threads.

    Raises:
        PerceptionError: if only the shipped networks are there, and are not asked for.
        AwarenavError: for a fetched network that has been altered.
    """
    networks = NetworkChoice.default(simulator=simulator_networks).load(settings=settings)
    admit_networks(networks, rendered=False, allowed=simulator_networks)
    return networks


def admit_networks(
    networks: Networks,
    *,
    rendered: bool,
    allowed: bool,
    or_else: str = "give simulator_networks=True, for pictures of the simulator",
) -> tuple[str, ...]:
    """Return the roles of networks that see such pictures for the first time.

    Args:
        networks: to be used.
        rendered: the pictures are renders of this package.
        allowed: networks of renders may see other pictures.
        or_else: says how they are allowed.

    Raises:
        PerceptionError: if they see such pictures and may not.
    """
    roles = () if rendered else simulator_networks(networks.training_domains)
    if roles and not allowed:
        raise PerceptionError(
            f"{simulator_networks_warning(roles)}: `awarenav models fetch {DEFAULT_SET}` brings "
            f"others, which are used from then on (or {or_else})"
        )
    return roles
