"""Pages that show meshes and scenes, in a browser or in a notebook."""

from __future__ import annotations

import operator
import os
import pathlib
import tempfile
import webbrowser
from typing import Any

from . import _cbvh

#: The most characters of a page that a notebook is asked to hold in a cell.
MAX_CELL = 64 << 20


class View:
    """A page that shows meshes: one HTML file, which needs no network. Made by `Mesh.view` and `Scene.view`.

    In a notebook, a cell that ends with a view shows it. `save` writes the page, and `open` shows it in the browser. The page
    holds the meshes and the library itself, so that it answers what this module answers, to the bit.
    """

    __slots__ = ("_page", "height")

    def __init__(self, page: _cbvh.Page, height: int = 600) -> None:
        if not isinstance(page, _cbvh.Page):
            raise TypeError(f"expected Mesh.view or Scene.view to make a view, found {type(page).__name__}")
        self._page = page
        #: The height in a notebook, in pixels.
        self.height = height

    def __repr__(self) -> str:
        return f"<cbvh.View of {self._page.size()} bytes of meshes>"

    def html(self) -> str:
        """The whole page."""
        return self._page.html().decode()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the page. A file of that name is replaced when all is written."""
        self._page.save(os.fsdecode(path))

    def open(self) -> str:
        """Writes the page to a new folder in the system's temporary folder, opens it in the browser, and returns its path.

        Nobody removes the page afterwards. Where there is no browser, the page is written nevertheless. A browser that may not
        read that folder needs `save`.
        """
        path = os.path.join(tempfile.mkdtemp(prefix="cbvh-view-"), "view.html")
        try:
            self.save(path)
        except BaseException:
            os.rmdir(os.path.dirname(path))
            raise
        webbrowser.open(pathlib.Path(path).as_uri())
        return path

    def _repr_html_(self) -> str:
        page = self.html()
        if len(page) > MAX_CELL:
            return f"<p>This view has {len(page)} characters, too many for a notebook: use its methods save or open.</p>"
        # Within quotes, nothing else has a meaning.
        page = page.replace("&", "&amp;").replace('"', "&quot;")
        style = f"width: 100%; height: {int(self.height)}px; border: 0"
        # The page runs its own code and saves files, and reaches nothing of the notebook.
        return f'<iframe srcdoc="{page}" sandbox="allow-scripts allow-downloads" style="{style}"></iframe>'


def called(path: str | None) -> tuple[str, str]:
    """The name and the path of the file of a mesh, as a page can have them: bytes that are no UTF-8 become U+FFFD."""
    if path is None:
        return "mesh", ""
    path = os.fsencode(path).decode(errors="replace")
    return os.path.basename(path), path


def show(page: _cbvh.Page, path: str | os.PathLike[str] | None) -> View:
    """The view of a page, which is saved if there is a path."""
    view = View(page)
    if path is not None:
        view.save(path)
    return view


def limit(max_bytes: Any) -> int | None:
    """The most bytes of meshes in a page; None leaves that to the library."""
    if max_bytes is None:
        return None
    try:
        most = operator.index(max_bytes)
    except TypeError:
        raise TypeError(f"max_bytes: expected a whole number or None, found {type(max_bytes).__name__}") from None
    if not 0 <= most < 2**63:
        raise ValueError(f"max_bytes: expected a whole number from 0 to 2^63 - 1, found {most}")
    return most
