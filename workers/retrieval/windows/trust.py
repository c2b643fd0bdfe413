"""How much each kind of evidence counts for a query: learned on creatures, not set by hand.

A part has another bank distance than its whole, noise ruins windows, and one side of a scan lacks
what lies behind. What a query is shows on itself: how long its boundary is, how rough it is, how
coarse. Each kind of evidence saturates, so that one that fails cannot outvote the others.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from workers.geometry.arrays import FloatArray
from workers.retrieval.windows.signature import SHEET, Signature

FEATURES = 4
"""Numbers of a query: 1, boundary, roughness, coarseness."""

NOT_VERIFIED = -3.0
"""ln p of a candidate whose matches were not verified, and the least there is."""

_SHARPNESS = 8.0  # of the bend at which evidence saturates
_ROUGH = 40.0  # degrees between faces: clean shapes have less than 20, noise more than 36
_FINE = 1000.0  # vertices, from which a mesh is not coarse
_MOST = (1.5, 1.5, 3.0)


@dataclass(frozen=True)
class Trust:
    """Weights of the bank's distance d, of windows X, and of their consistency p.

    Attributes
    ----------
    distance, windows, consistency : tuple of 4 float
        A weight is ln(1 + exp(these · features)).
    facing : tuple of 2 float
        Share of the windows that face the same way: logistic, of 1 and boundary.
    most_distance, most_windows : float
        Where d and X saturate.
    """

    distance: tuple[float, ...]
    windows: tuple[float, ...]
    consistency: tuple[float, ...]
    facing: tuple[float, ...]
    most_distance: float
    most_windows: float

    def weights(self, query: Signature) -> "Weights":
        """Weights for a query.

        Parameters
        ----------
        query : Signature
            Its features count.

        Returns
        -------
        Weights
        """
        features = query_features(query)
        distance, windows, consistency = (
            float(np.logaddexp(0.0, np.dot(one, features)))
            for one in (self.distance, self.windows, self.consistency)
        )
        facing = 1.0 / (1.0 + np.exp(-float(np.dot(self.facing, features[:2]))))
        return Weights(
            distance, windows, consistency, facing, self.most_distance, self.most_windows
        )

    def to_json(self) -> dict[str, Any]:
        """Plain JSON, five digits.

        Returns
        -------
        dict
        """
        found: dict[str, Any] = {}
        for field in fields(self):
            value = getattr(self, field.name)
            is_one = isinstance(value, float)
            found[field.name] = _rounded(value) if is_one else [_rounded(one) for one in value]
        return found

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> "Trust":
        """Return the trust that `to_json` wrote.

        Parameters
        ----------
        value : Mapping
            Plain JSON.

        Returns
        -------
        Trust

        Raises
        ------
        ValueError, KeyError, TypeError
            It is none.
        """
        distance, windows, consistency, facing = (
            tuple(float(one) for one in value[name])
            for name in ("distance", "windows", "consistency", "facing")
        )
        counts = [len(one) for one in (distance, windows, consistency, facing)]
        if counts != [FEATURES] * 3 + [2]:
            raise ValueError(f"weights of evidence have {counts} numbers")
        caps = float(value["most_distance"]), float(value["most_windows"])
        if not all(0.0 < cap < np.inf for cap in caps):
            raise ValueError(f"evidence saturates at {caps}, expected finite numbers above 0")
        return cls(distance, windows, consistency, facing, *caps)


@dataclass(frozen=True)
class Weights:
    """How evidence counts for one query.

    Attributes
    ----------
    distance, windows, consistency : float
        Not negative.
    facing : float
        Share of the windows that face the same way.
    most_distance, most_windows : float
        Where d and X saturate.
    """

    distance: float
    windows: float
    consistency: float
    facing: float
    most_distance: float
    most_windows: float

    def fused(
        self, distances: FloatArray, differences: FloatArray, log_consistency: FloatArray
    ) -> FloatArray:
        """One distance of all evidence, in about the unit of the bank's.

        Parameters
        ----------
        distances : (n,) float64
            d.
        differences : (n,) float64
            X; infinite where a candidate was not compared.
        log_consistency : (n,) float64
            ln p, from `NOT_VERIFIED` to 0.

        Returns
        -------
        (n,) float64
            0 where all evidence is perfect; grows with d and X, and falls with p.
        """
        total = self.distance + self.windows
        evidence = self.distance * saturated(distances, self.most_distance)
        evidence += self.windows * saturated(differences, self.most_windows)
        evidence -= self.consistency * log_consistency
        fused: FloatArray = evidence / max(total, np.finfo(np.float64).tiny)
        return fused

    def from_distance(self, distances: FloatArray) -> FloatArray:
        """One distance of shapes of which the bank's alone is known.

        Parameters
        ----------
        distances : (n,) float64
            d.

        Returns
        -------
        (n,) float64
            As `fused` has it if X and ln p had gone as far as d on their ways to their ends.
        """
        share = saturated(distances, self.most_distance) / self.most_distance
        return self.fused(distances, share * self.most_windows, share * NOT_VERIFIED)


def saturated(values: FloatArray, most: float) -> FloatArray:
    """Values as they are while they are small, and at most ``most``.

    Parameters
    ----------
    values : (n,) float64
        Not negative; may be infinite.
    most : float
        What they tend to.

    Returns
    -------
    (n,) float64
        Growing, 0 for 0.
    """
    share = np.minimum(np.asarray(values, dtype=np.float64) / most, 1e6)
    found: FloatArray = most * share / (1.0 + share**_SHARPNESS) ** (1.0 / _SHARPNESS)
    return found


def query_features(query: Signature) -> FloatArray:
    """What a query shows of itself, (4,).

    Parameters
    ----------
    query : Signature
        Of the query.

    Returns
    -------
    (4,) float64
        1; length of the open boundary over that of a sheet; median angle between faces over 40°;
        ln of how many times fewer vertices it has than 1,000. Each is at most 1.5, 1.5 or 3.
    """
    coarse = max(0.0, float(np.log(_FINE / max(query.n_vertices, 1))))
    found = (query.boundary / SHEET, query.roughness / _ROUGH, coarse)
    return np.array([1.0, *np.minimum(found, _MOST)])


def _rounded(value: float) -> float:
    return float(f"{value:.5g}")
