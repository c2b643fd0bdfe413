"""What each channel counts for a query: a view that noise has ruined has no say.

Noise makes a surface grow and buries what is small on it. A smoothed view does not mind; a plain
one does, and with as much weight as ever it outvotes the smoothed one. How rough a surface is can
be told from itself, before anything is compared. So a model may have a channel of roughness for a
view: up to the first of its levels the view's channels count in full, from the second on not at
all, between them less and less; the others count for them. Only the query is asked, so that all
that it is compared with are compared alike, and no statistics of the gallery enter.
"""

from dataclasses import replace

import numpy as np

from workers.geometry.arrays import Float32Array, FloatArray
from workers.retrieval.model import Model


def trust(descriptors: Float32Array | FloatArray, model: Model) -> FloatArray:
    """Share of its weight that each of a model's channels keeps, from 0 to 1.

    Parameters
    ----------
    descriptors : (q, d) float32
        Of queries.
    model : Model

    Returns
    -------
    (q, c) float64; 1 where a channel's view has no roughness, or no other view could count for it.
    """
    shares = np.ones((len(descriptors), len(model.channels)))
    rough = {channel.view: channel for channel in model.channels if channel.is_of_roughness}
    if all(channel.view in rough for channel in model.scanned):
        return shares
    for view, channel in rough.items():
        clean, ruined = channel.levels or (0.0, 1.0)
        found = np.asarray(descriptors[:, model.slices[channel.name].start], dtype=np.float64)
        of_view = np.array([other.view == view for other in model.channels])  # (c,)
        left = np.clip((ruined - found) / (ruined - clean), 0.0, 1.0)  # (q,)
        shares[:, of_view] = left[:, None]
    return shares


def trusted(query: Float32Array | FloatArray, model: Model) -> Model:
    """Return the model with the weights that its channels have for a query.

    Their sum stays what it was, so that distances of rough queries and of clean ones mean the same.

    Parameters
    ----------
    query : (d,) float32
    model : Model

    Returns
    -------
    Model
        The one that was given, if the query is not rough, or nothing would be left to scan by.
    """
    shares = trust(query[None], model)[0]  # (c,)
    if np.all(shares == 1.0):
        return model
    weights = np.array([channel.weight for channel in model.channels])
    kept = weights * shares
    kept *= weights.sum() / max(kept.sum(), np.finfo(np.float64).tiny)
    channels = zip(model.channels, kept.tolist(), strict=True)
    found = replace(model, channels=tuple(replace(one, weight=weight) for one, weight in channels))
    return found if any(channel.weight > 0.0 for channel in found.scanned) else model
