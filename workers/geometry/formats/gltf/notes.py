"""What reading a glTF file has to say, gathered by all of its parts."""

from collections import Counter
from dataclasses import dataclass, field


def counted(count: int, noun: str) -> str:
    """Count of things, in words.

    Parameters
    ----------
    count : int
        From 1.
    noun : str
        For one of them.

    Returns
    -------
    str
        "1 texture", "2 textures", "2 primitives of points".
    """
    if count == 1:
        return f"1 {noun}"
    for preposition in (" of ", " without "):
        head, found, rest = noun.partition(preposition)
        if found:
            return f"{count:,} {head}s{found}{rest}"
    return f"{count:,} {noun}s"


@dataclass
class Notes:
    """Repairs and findings.

    Attributes
    ----------
    repairs : list of str
        Sentences; those that are said again are left out at the end.
    found : Counter of str
        How many of which things were left alone, each a noun for one.
    """

    repairs: list[str] = field(default_factory=list)
    found: Counter[str] = field(default_factory=Counter)

    def repaired(self) -> tuple[str, ...]:
        """Return each repair once, in the order in which they were made.

        Returns
        -------
        tuple of str
            Sentences.
        """
        return tuple(dict.fromkeys(self.repairs))

    def left_alone(self) -> tuple[str, ...]:
        """Return what was found besides, with its counts.

        Returns
        -------
        tuple of str
            Such as "2 hidden nodes".
        """
        return tuple(counted(count, noun) for noun, count in self.found.items() if count)
