"""Which rows of a matrix belong to which shape."""

from collections.abc import Iterable


class ShapeRows:
    """Rows of each shape, oldest to newest; rows are added and never taken away.

    Because nothing is taken away, a snapshot of the first n rows may share this object with an
    index that grows. The snapshot looks up the newest row below n. One thread at a time may add;
    any number of threads may look up.

    Parameters
    ----------
    shape_ids : iterable of str
        Shapes of the rows 0, 1, 2, …
    """

    def __init__(self, shape_ids: Iterable[str]) -> None:
        self._newest: dict[str, int] = {}
        self._earlier: dict[int, int] = {}
        for row, shape_id in enumerate(shape_ids):
            self.add(shape_id, row)

    def add(self, shape_id: str, row: int) -> None:
        """Note a row of a shape.

        Parameters
        ----------
        shape_id : str
            The shape.
        row : int
            Its new row, above all rows that were added before.
        """
        earlier = self._newest.get(shape_id)
        if earlier is not None:
            self._earlier[row] = earlier  # before `_newest`, from which a reader starts
        self._newest[shape_id] = row

    def newest(self, shape_id: str, *, below: int) -> int | None:
        """Return the newest row of a shape among the first ``below`` rows.

        The search goes back from the shape's last row. So its cost is the number of times that
        this shape was replaced after those rows, not the number of rows.

        Parameters
        ----------
        shape_id : str
            Any text; one that is no shape of the matrix has no row.
        below : int
            How many rows count.

        Returns
        -------
        int or None
            The row, or None where the shape has none among them.
        """
        row = self._newest.get(shape_id)
        while row is not None and row >= below:
            row = self._earlier.get(row)
        return row
