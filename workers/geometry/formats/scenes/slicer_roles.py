"""What slicers call the parts of an object that are not printed themselves."""

import re

BODIES = ("", "modelpart", "normalpart", "model", "solid", "solidpart", "object", "body")
ROLES = {
    **{"parametermodifier": "modifier", "modifierpart": "modifier"},
    **{"negativevolume": "negative volume", "negativepart": "negative volume"},
    **{"supportenforcer": "support enforcer", "supportblocker": "support blocker"},
    "support": "support volume",
}


def role_of(type: str) -> str:
    """Name what a part is, of a slicer's word for it.

    Parameters
    ----------
    type : str
        "ModelPart", "ParameterModifier", "negative_part", or nothing.

    Returns
    -------
    str
        "modifier", "negative volume", "support enforcer", "support blocker" or "support volume";
        empty for a body; "modifier" for a word that is not known.
    """
    plain = re.sub(r"[^a-z]", "", type.lower())
    return "" if plain in BODIES else ROLES.get(plain, "modifier")
