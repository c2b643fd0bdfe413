"""Models of a method and its parameters, with nothing to learn."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from workers.diffusion.kernels import BiharmonicKernel, CommuteTimeKernel
from workers.errors import InvalidRequestError
from workers.geometry.views import View
from workers.retrieval.builtin import distance_model, heat_model, shape_dna_model
from workers.retrieval.model import Model

UNTRAINED_METHODS = ("heat", "commute-time", "biharmonic", "shape-dna")


def untrained_model(name: str, method: str, parameters: Mapping[str, Any], *, view: View) -> Model:
    """Model of one channel whose kernel is known beforehand.

    Parameters
    ----------
    name : str
        Of the model.
    method : str
        One of `UNTRAINED_METHODS`.
    parameters : Mapping
        They stay with the model. ``time`` and ``unit`` for heat; ``unit`` for commute-time, whose
        distances are the same in every unit but for rounding; ``eigenvalues`` for shape-dna.
    view : View
        Under which its one channel is described.

    Returns
    -------
    Model
        Ready to describe with.

    Raises
    ------
    InvalidRequestError
        There is no such method, or its parameters make no sense.
    """
    match method:
        case "heat":
            model = heat_model(view, time=parameters["time"], normalisation=parameters["unit"])
        case "commute-time":
            kernel, unit = CommuteTimeKernel(), parameters["unit"]
            model = distance_model(method, kernel, view, normalisation=unit, top=4.0)
        case "biharmonic":
            model = distance_model(
                method, BiharmonicKernel(), view, normalisation="first-eigenvalue", top=3.2
            )
        case "shape-dna":
            count = parameters["eigenvalues"]
            if count > view.eigenpairs:
                raise InvalidRequestError(
                    f"{count} eigenvalues asked for, but {view.eigenpairs} are computed"
                )
            model = shape_dna_model(view, eigenvalues=count)
        case _:
            raise InvalidRequestError(
                f"there is no method {method!r}; there are {', '.join(UNTRAINED_METHODS)}"
            )
    return replace(model, name=name, parameters=parameters)
