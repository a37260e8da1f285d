"""The choice of networks for pictures, and the refusal of those that have seen none such."""

from __future__ import annotations

from typing import ClassVar

from .._manifest import simulator_networks, simulator_networks_warning
from ..config import StrictConfig
from ..errors import AwarenavError, PerceptionError
from ..networks import OnnxSettings
from ._catalogue import DEFAULT_SET, RealModel
from ._folder import NetworkFolder
from ._load import EYES, HEADS, NONE, SHIPPED, Networks, catalogued, choose_networks


class NetworkChoice(StrictConfig):
    """The networks by name, as ``--networks`` reads them from a file.

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
    def default(cls, *, simulator: bool) -> NetworkChoice:
        """Return the networks that pictures get where nothing else is named.

        They are those of the set ``real``, if that has been fetched completely; else the shipped
        ones, which :func:`admit_networks` refuses outside the simulator.

        Args:
            simulator: the pictures are renders of this package, or count as such; they get the
                shipped networks.
        """
        folder = NetworkFolder()
        known = {each.name for each in folder.catalogue.models}
        for each in () if simulator else folder.catalogue.sets:
            if each.name == DEFAULT_SET:
                named = each.model_dump(include=set(cls.model_fields), exclude_none=True)
                chosen = cls(**named)
                wanted = known.intersection(map(str, named.values()))
                if all(map(folder.is_fetched, wanted)):
                    return chosen
        return cls()

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
