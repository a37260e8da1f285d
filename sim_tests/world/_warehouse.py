"""The simulated hall: it owns the physics and everything in it that stands still."""

from __future__ import annotations

from typing import Final

from awarenav.closing import Closing
from awarenav.errors import not_one_of
from perception.arrays import FloatArray, finite_number

from .bullet import pybullet
from .errors import SimError
from .hall import WarehouseLayout
from .render import RENDERERS, RendererName, VisualActor, Visuals

GRAVITY_MPS2: Final = 9.81
DEFAULT_PHYSICS_DT_S: Final = 1.0 / 240.0

# Collision groups: people are moved, not simulated, so they meet only robots. Bit 1 is Bullet's
# own group of rays: whatever admits it is hit by ray tests.
RAY_GROUP: Final = 1
STATIC_GROUP: Final = 2
ROBOT_GROUP: Final = 4
PERSON_GROUP: Final = 8


class Warehouse(Closing):
    """A physics world of its own with floor, walls and racks; use it as a context manager.

    Every instance starts a fresh PyBullet world (no window), so two with the same inputs give the
    same bytes. Robots and people join by being constructed with it. What a camera sees is a second
    world, :attr:`visuals`, so that pictures never change the physics.

    Args:
        layout: what stands where; None is :meth:`WarehouseLayout.crossing`.
        physics_dt_s: length of one step, in (0, 1/60].
        renderer: ``"tiny"``, ``"gl"`` or ``"auto"``, what draws :attr:`visuals`.
        variant: number of the scenery's variant (goods, colours, wear).

    Attributes:
        layout: as given.
        physics_dt_s: as given.
        client: PyBullet's id of this world.
        obstacle_boxes_odom: (N, 4) x_min, y_min, x_max, y_max of racks and walls, metres.

    Raises:
        SimError: for a step that is not in range, an unknown renderer, and after :meth:`close`.
    """

    def __init__(
        self,
        layout: WarehouseLayout | None = None,
        physics_dt_s: float = DEFAULT_PHYSICS_DT_S,
        *,
        renderer: RendererName = "tiny",
        variant: int = 0,
    ) -> None:
        self.physics_dt_s = finite_number(
            "physics_dt_s",
            physics_dt_s,
            SimError,
            minimum=0.0,
            maximum=1.0 / 60.0,
            exclusive_minimum=True,
        )
        if renderer not in RENDERERS:
            raise SimError(not_one_of("renderer", renderer, RENDERERS))
        self.layout = WarehouseLayout.crossing() if layout is None else layout
        self._renderer: RendererName = renderer
        self._variant = variant
        self._visuals: Visuals | None = None
        self._actors: list[VisualActor] = []
        self.obstacle_boxes_odom: FloatArray = self.layout.obstacle_boxes_odom
        self._steps = 0
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
        self._static_bodies = frozenset({self._add_floor(), *self._add_boxes()})

    @property
    def visuals(self) -> Visuals:
        """The picture world, made when it is first asked for; it never touches the physics."""
        if self._visuals is None:
            if self.client < 0:
                raise SimError("the warehouse is closed: there is nothing left to see")
            self._visuals = Visuals(self.layout, self._renderer, self._variant)
            for actor in self._actors:
                self._visuals.add_actor(actor)
        return self._visuals

    def add_actor(self, actor: VisualActor) -> int:
        """Let something that moves be seen in pictures; returns its number in them.

        Costs nothing until the first picture is taken.
        """
        self._actors.append(actor)
        if self._visuals is not None:
            return self._visuals.add_actor(actor)
        return len(self._actors) - 1

    @property
    def actors(self) -> tuple[VisualActor, ...]:
        """All that :meth:`add_actor` was given."""
        return tuple(self._actors)

    @property
    def variant(self) -> int:
        """Number of the scenery's variant."""
        return self._variant

    def close(self) -> None:
        """End the physics world and the picture world; a second call does nothing."""
        if self._visuals is not None:
            self._visuals.close()
        if self.client >= 0:
            pybullet.disconnect(physicsClientId=self.client)
            self.client = -1

    @property
    def steps(self) -> int:
        """Physics steps since the start."""
        return self._steps

    @property
    def time_s(self) -> float:
        """Simulated time since the start, a whole number of steps."""
        return self._steps * self.physics_dt_s

    @property
    def static_bodies(self) -> frozenset[int]:
        """PyBullet's ids of the floor, the walls and the racks."""
        return self._static_bodies

    def step(self) -> None:
        """Advance the physics by ``physics_dt_s``."""
        if self.client < 0:
            raise SimError("the warehouse is closed: it can no longer step")
        pybullet.stepSimulation(physicsClientId=self.client)
        self._steps += 1

    def _add_floor(self) -> int:
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
        self._set_static(body)
        return body

    def _add_boxes(self) -> list[int]:
        bodies = []
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
            self._set_static(body)
            bodies.append(int(body))
        return bodies

    def _set_static(self, body: int) -> None:
        pybullet.setCollisionFilterGroupMask(
            body, -1, STATIC_GROUP, ROBOT_GROUP | RAY_GROUP, physicsClientId=self.client
        )
