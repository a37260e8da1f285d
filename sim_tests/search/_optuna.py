"""Optuna and SQLAlchemy, which Optuna brings; the only module that imports them."""

from __future__ import annotations

from typing import Final

from perception.installation import install_command

from ..world.errors import SimError

try:
    import cmaes  # noqa: F401 - the sampler imports it only when it samples
    import optuna
    from sqlalchemy import event
    from sqlalchemy.exc import SQLAlchemyError
except ImportError as cause:  # pragma: no cover - depends on the installation
    raise SimError(
        "tuning and falsification need optuna and cmaes, of which one is not installed; both are "
        f"part of the extra 'bench': {install_command('bench')}"
    ) from cause

optuna.logging.set_verbosity(optuna.logging.WARNING)

#: Errors of a study's file.
DATABASE_ERRORS: Final = (optuna.exceptions.StorageInternalError, SQLAlchemyError)

__all__ = ["DATABASE_ERRORS", "event", "optuna"]
