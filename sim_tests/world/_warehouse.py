"""The simulated warehouse: the physics world with floor, walls, racks and props."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager
from types import TracebackType
from typing import Final, NamedTuple

from awarenav.errors import not_one_of
from perception.arrays import FloatArray

from .bullet import pybullet
from .errors import SimError
from .hall import WarehouseLayout
from .render import RENDERERS, RendererName, VisualActor, Visuals

GRAVITY_MPS2: Final = 9.81

# Collision groups. People are placed, not simulated, so they collide with robots only. Bit 1 is
# Bullet's own group of ray tests: they hit every body whose mask has this bit.
RAY_GROUP: Final = 1
STATIC_GROUP: Final = 2
ROBOT_GROUP: Final = 4
PERSON_GROUP: Final = 8


class Nearest(NamedTuple):
    """The places where the surfaces of two bodies are nearest to each other.

    Attributes:
        distance_m: between them; negative where the bodies overlap.
        first_odom_m: (3,) the place on the first body.
        second_odom_m: (3,) the place on the second.
        towards_first: (3,) unit normal on the second body.
    """

    distance_m: float
    first_odom_m: tuple[float, float, float]
    second_odom_m: tuple[float, float, float]
    towards_first: tuple[float, float, float]


class Warehouse(AbstractContextManager["Warehouse"]):
    """A physics world with floor, walls, racks and props; use it as a context manager.

    Every instance starts a PyBullet world of its own without a window, so the same inputs give the
    same bytes. Robots and people are constructed with the warehouse that they join. Cameras see a
    second world, :attr:`visuals`, so that rendering never changes the physics.

    Args:
        layout: the hall; None is the shipped layout ``"crossing"``.
        renderer: ``"tiny"``, ``"gl"`` or ``"auto"``, the renderer of :attr:`visuals`.
        variant: number of the scenery's variant (goods, colours, wear).

    Attributes:
        layout: as given.
        variant: as given.
        steps: number of physics steps since the start.
        client: PyBullet's id of this world; −1 once it is closed.
        obstacle_boxes_odom: (N, 4) x_min, y_min, x_max, y_max of racks, walls and props, metres.
        obstacle_bodies: PyBullet's ids of the same.

    Raises:
        SimError: for an unknown renderer, and after :meth:`close`.
    """

    #: Length of one step.
    physics_dt_s: Final = 1.0 / 240.0

    def __init__(
        self,
        layout: WarehouseLayout | None = None,
        *,
        renderer: RendererName = "tiny",
        variant: int = 0,
    ) -> None:
        if renderer not in RENDERERS:
            raise SimError(not_one_of("renderer", renderer, RENDERERS))
        self.layout = WarehouseLayout.named("crossing") if layout is None else layout
        self._renderer: RendererName = renderer
        self.variant = variant
        self._visuals: Visuals | None = None
        self._actors: list[VisualActor] = []
        self.obstacle_boxes_odom: FloatArray = self.layout.obstacle_boxes_odom
        self.steps = 0
        self.client: int = pybullet.connect(pybullet.DIRECT)
        if self.client < 0:
            raise SimError("PyBullet could not start another physics world")
        pybullet.setGravity(0.0, 0.0, -GRAVITY_MPS2, physicsClientId=self.client)
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=self.physics_dt_s,
            numSubSteps=0,
            numSolverIterations=30,
            deterministicOverlappingPairs=1,
            enableConeFriction=0,
            physicsClientId=self.client,
        )
        self._add_floor()
        self.obstacle_bodies = frozenset(self._add_boxes())

    @property
    def visuals(self) -> Visuals:
        """The render world, made on first use; it never changes the physics."""
        if self._visuals is None:
            if self.client < 0:
                raise SimError("the warehouse is closed: it has no visuals any more")
            self._visuals = Visuals(self.layout, self._renderer, self.variant)
            for actor in self._actors:
                self._visuals.add_actor(actor)
        return self._visuals

    def add_actor(self, actor: VisualActor) -> int:
        """Add something that moves to the images; return its number in them.

        It costs nothing until the first image is rendered.
        """
        self._actors.append(actor)
        if self._visuals is not None:
            return self._visuals.add_actor(actor)
        return len(self._actors) - 1

    @property
    def actors(self) -> tuple[VisualActor, ...]:
        """The actors in the order of their numbers."""
        return tuple(self._actors)

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the physics world and the render world; a second call does nothing."""
        if self._visuals is not None:
            self._visuals.close()
        if self.client >= 0:
            pybullet.disconnect(physicsClientId=self.client)
            self.client = -1

    @property
    def time_s(self) -> float:
        """The simulated time since the start, a whole number of steps."""
        return self.steps * self.physics_dt_s

    def step(self) -> None:
        """Advance the physics by ``physics_dt_s``."""
        if self.client < 0:
            raise SimError("the warehouse is closed: it cannot step any more")
        pybullet.stepSimulation(physicsClientId=self.client)
        self.steps += 1

    def nearest(self, first: int, second: int, within_m: float) -> Nearest | None:
        """Return where two bodies are nearest to each other; None if that is farther than given.

        Args:
            first: id of a body.
            second: id of another.
            within_m: the distance. Pairs of shapes beyond it cost nothing.
        """
        pairs = pybullet.getClosestPoints(first, second, within_m, physicsClientId=self.client)
        if not pairs:
            return None
        closest = min(pairs, key=lambda pair: pair[8])
        return Nearest(float(closest[8]), *closest[5:8])

    def _add_floor(self) -> None:
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_PLANE, planeNormal=[0.0, 0.0, 1.0], physicsClientId=self.client
        )
        body = int(
            pybullet.createMultiBody(
                0.0, shape, useMaximalCoordinates=True, physicsClientId=self.client
            )
        )
        pybullet.changeDynamics(
            body,
            -1,
            lateralFriction=self.layout.floor_friction,
            restitution=0.0,
            physicsClientId=self.client,
        )
        self._make_static(body)

    def _add_boxes(self) -> Iterator[int]:
        for (x_min, y_min, x_max, y_max), height in zip(
            self.obstacle_boxes_odom.tolist(), self.layout.obstacle_heights_m.tolist(), strict=True
        ):
            shape = pybullet.createCollisionShape(
                pybullet.GEOM_BOX,
                halfExtents=[0.5 * (x_max - x_min), 0.5 * (y_max - y_min), 0.5 * height],
                physicsClientId=self.client,
            )
            body = pybullet.createMultiBody(
                0.0,
                shape,
                basePosition=[0.5 * (x_min + x_max), 0.5 * (y_min + y_max), 0.5 * height],
                useMaximalCoordinates=True,
                physicsClientId=self.client,
            )
            self._make_static(body)
            yield body

    def _make_static(self, body: int) -> None:
        pybullet.setCollisionFilterGroupMask(
            body, -1, STATIC_GROUP, ROBOT_GROUP | RAY_GROUP, physicsClientId=self.client
        )
