"""Weights for a query: a view that noise has ruined counts less, and the others more.

Noise makes a surface grow and buries what is small on it. A smoothed view does not mind. A plain
one does, and with its usual weight it outvotes the smoothed one. How rough a surface is can be
measured on itself, before anything is compared. So a model may have `RoughnessLimits` for a view.
Only the query is measured: all rows are compared with the same weights, and no statistics of the
gallery enter (decision 16).
"""

from dataclasses import replace

import numpy as np

from workers.geometry.arrays import Float32Array, FloatArray
from workers.retrieval.model import Model


def kept_shares(descriptors: Float32Array | FloatArray, model: Model) -> FloatArray:
    """Share of its weight that each of a model's channels keeps for each query.

    Parameters
    ----------
    descriptors : (q, d) float32
        Of queries.
    model : Model
        Under which they were described.

    Returns
    -------
    (q, c) float64, in [0, 1]; 1 where a channel's view has no limits of roughness, or where every
    view that is scanned has.
    """
    shares = np.ones((len(descriptors), len(model.channels)))
    limited = {limits.view for limits in model.roughness_limits}
    if all(channel.view in limited for channel in model.scanned):
        return shares
    for limits in model.roughness_limits:
        found = np.asarray(descriptors[:, model.slices[limits.name].start], dtype=np.float64)
        of_view = np.array([channel.view == limits.view for channel in model.channels])  # (c,)
        shares[:, of_view] = limits.kept_share(found)[:, None]
    return shares


def weighted_for(query: Float32Array | FloatArray, model: Model) -> Model:
    """Model with the weights that its channels have for a query.

    Their sum stays what it was, so that distances of rough queries and of clean ones mean the same.

    Parameters
    ----------
    query : (d,) float32
        Descriptor.
    model : Model
        Under which it was described.

    Returns
    -------
    Model
        The one that was given, if the query is not rough, or nothing would be left to scan by.
    """
    if not model.roughness_limits:
        return model
    shares = kept_shares(query[None], model)[0]  # (c,)
    if np.all(shares == 1.0):
        return model
    weights = np.array([channel.weight for channel in model.channels])
    kept = weights * shares
    kept *= weights.sum() / max(kept.sum(), np.finfo(np.float64).tiny)
    channels = zip(model.channels, kept.tolist(), strict=True)
    found = replace(model, channels=tuple(replace(one, weight=weight) for one, weight in channels))
    return found if any(channel.weight > 0.0 for channel in found.scanned) else model
