"""Channels as they are stored: the type is found by the name of its feature."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from workers.errors import InvalidRequestError
from workers.retrieval.channels.area import AreaChannel
from workers.retrieval.channels.base import NO_CENTRE, Channel
from workers.retrieval.channels.diagonal import DiagonalChannel
from workers.retrieval.channels.distances import DistanceChannel
from workers.retrieval.channels.eigenvalues import EigenvalueChannel
from workers.retrieval.channels.log_diagonal import LogDiagonalChannel
from workers.retrieval.channels.points import PointsChannel

CHANNELS: Mapping[str, type[Channel]] = MappingProxyType(
    {
        channel.feature: channel
        for channel in (
            DistanceChannel,
            DiagonalChannel,
            LogDiagonalChannel,
            PointsChannel,
            EigenvalueChannel,
            AreaChannel,
        )
    }
)
"""Every type by the name of its feature."""

PRESENT = ("kernel", "edges", "levels", "centre")
"""What some types have and others have not."""


def channel_from_json(value: Mapping[str, Any]) -> Channel:
    """Return the channel that `Channel.to_json` wrote.

    Parameters
    ----------
    value : Mapping
        Plain JSON.

    Returns
    -------
    Channel
        Of the type that "feature" names.

    Raises
    ------
    InvalidRequestError
        Something is missing, of another type, or nothing that this feature has.
    """
    try:
        feature = str(value["feature"])
        if feature not in CHANNELS:
            raise InvalidRequestError(
                f"channel {value.get('name')!r}: there is no feature {feature!r}; "
                f"there are {', '.join(CHANNELS)}"
            )
        channel = CHANNELS[feature].from_json(value)
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise InvalidRequestError(f"the channel cannot be read: {error!r}") from error
    stored = channel.to_json()
    for key in PRESENT:
        if _is_given(value.get(key)) != _is_given(stored.get(key)):
            raise channel.invalid(
                f"{key} is {value.get(key)!r}, expected {stored.get(key)!r} of the feature "
                f"{feature!r}"
            )
    return channel


def _is_given(value: object) -> bool:
    return value is not None and value != NO_CENTRE
