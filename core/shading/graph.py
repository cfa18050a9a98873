"""shader nodes -> Values.  The numbers that nodes feed into each other, as a graph of steps.

Each kind of node is a function of `nodes.NODES` that makes values out of the node's inputs.  What
is not there yet is written down by name and replaced by the socket's own value: never silently.
"""

from collections.abc import Callable, Collection, Hashable, Iterable, Iterator, Mapping
from functools import cached_property
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from ..images import Image, ImageSource, Tiles
from ..images.sheet import Sheet
from ..images.shelf import Shelf
from ..images.store import Store
from ..scene import Colour, Link, Material, Node, Note, Socket
from .sky.disc import Disc
from .values import COLOUR, FLOAT, LARGEST, VECTOR, Value, constant, grey, value, widened

WHITE: Colour = (1.0, 1.0, 1.0)
NodeFunction = Callable[["Graph", Node, str], Value | None]


class Library:
    """What is made once for all shaders of a scene: images, skies, by their source.

    It is forgotten when nobody holds the source any more.  side: what both sides of images are
    limited to, 0 is no limit; spare: what their levels may take [bytes], None: there are none;
    room: what sheets may take [bytes]; shelf: what was made for earlier scenes, if that is kept;
    store: in place of one of these limits.
    """

    def __init__(
        self,
        side: int = 0,
        spare: float | None = None,
        room: float = 0.0,
        shelf: Shelf | None = None,
        store: Store | None = None,
    ) -> None:
        self._known: WeakKeyDictionary[Any, Any] = WeakKeyDictionary()
        self.store = store or Store(side, spare, shelf)
        self.sheets: dict[Hashable, Sheet] = {}
        self.room = room

    def renew(self, spare: float | None = None, room: float = 0.0) -> None:
        """Read files anew from now on, but for sources that are known: a file may have changed.

        spare: what levels of images may take that are new [bytes]; room: what sheets may take.
        """
        self.store = Store(self.store.side, spare, self.store.shelf)
        self.room = room

    @property
    def memory(self) -> int:
        """What the texels of all images take, with their levels and sheets [bytes]."""
        return self.store.memory + sum(sheet.memory for sheet in self.sheets.values())

    def sheet(self, key: Hashable, make: Callable[[], Sheet]) -> Sheet | None:
        """Return a sheet, made if it is not known; None if it has no room."""
        if key not in self.sheets:
            shelf = self.store.shelf
            made = (shelf and shelf.find(key)) or make()
            if sum(each.memory for each in (made, *self.sheets.values())) > self.room:
                return None
            self.sheets[key] = made
        return self.sheets[key]

    def keep_sheets(self, used: Collection[Sheet]) -> None:
        """Forget the sheets that are not among the used ones; make those that are."""
        self.sheets = {key: sheet for key, sheet in self.sheets.items() if sheet in used}
        for key, sheet in self.sheets.items():
            sheet.pack()
            if self.store.shelf is not None:
                self.store.shelf.put(key, sheet)

    def __contains__(self, source: ImageSource) -> bool:
        return source in self._known

    def read(self, sources: Iterable[ImageSource]) -> None:
        """Read the files of sources that are not known, several at the same time."""
        self.store.read(source for source in sources if source not in self)

    def image(self, source: ImageSource, notes: list[Note]) -> Image | Tiles:
        """Return the image of a source; `notes` of it are added each time."""

        def load() -> tuple[Image | Tiles, list[Note]]:
            own: list[Note] = []
            return self.store.get(source, own), own

        image, own = self.get(source, load)
        notes += [note for note in own if note not in notes]
        return image

    def get(self, source: Any, make: Callable[[], Any]) -> Any:
        """Return what is made of `source`, the very same object; made if it is not known."""
        if source not in self._known:
            self._known[source] = make()
        return self._known[source]


class Graph:
    """Makes values of node sockets; `notes` are what it could not honour.

    A node's output is made once, however many sockets it feeds.  root: the shader that all belongs
    to; material_index: the number that the user gave the material; bump_width [pixels]: how far
    beside the hit heights are looked at; discs: of suns in the sky; far: how far Ambient Occlusion
    looks that does not say so [m]; finest: width and height of the largest picture of the
    surroundings.
    """

    def __init__(
        self,
        owner: str,
        table: Mapping[str, NodeFunction],
        library: Library | None = None,
        root: Node | None = None,
    ) -> None:
        self.owner = owner
        self.library = library or Library()
        self.notes: list[Note] = []
        self.discs: tuple[Disc, ...] = ()
        self.finest = (0, 0)
        self.material_index = 0
        self.far = np.inf
        self.bump_width = 0.1
        self._table = table
        self._root = root
        self._circles: set[tuple[int, str]] = set()  # inputs of nodes, by their ids
        self._known: dict[tuple[int, str], Value | None] = {}
        self._shared: dict[Hashable, Value] = {}

    def note(self, what: str) -> None:
        """Write down, once, what the picture does not honour."""
        note = Note(self.owner, what)
        if note not in self.notes:
            self.notes.append(note)

    def number(self, node: Node, socket: str, default: float = 0.0) -> Value:
        """Return the scalar at an input."""
        return grey(self._at(node, socket, default, FLOAT))

    def colour(self, node: Node, socket: str, default: Colour = WHITE) -> Value:
        """Return the colour at an input."""
        return widened(self._at(node, socket, default, COLOUR), COLOUR)

    def vector(self, node: Node, socket: str, default: Colour | None = None) -> Value | None:
        """Return the vector at an input; None where nothing feeds it and there is no default."""
        found = node.inputs.get(socket, default)
        if isinstance(found, Link):
            made = self._linked(node, socket, found)
            if made is not None:
                return widened(made, VECTOR)
            found = found.default
        if found is None:
            found = default
        return None if found is None else widened(self._plain(node, socket, found, VECTOR), VECTOR)

    def whole(self, node: Node, socket: str, default: float = 0.0) -> Value:
        """Return the vector at an input, of three times `default` where there is none."""
        found = self.vector(node, socket, (default, default, default))
        assert found is not None
        return found

    def has(self, node: Node, socket: str) -> bool:
        """Whether a node has an input of this name."""
        return socket in node.inputs

    def is_linked(self, node: Node, socket: str) -> bool:
        """Whether something that is known feeds an input."""
        found = node.inputs.get(socket)
        return isinstance(found, Link) and self._linked(node, socket, found) is not None

    @cached_property
    def _used(self) -> frozenset[tuple[int, str]]:
        """Outputs that feed anything, each with the id of its node."""
        return frozenset((id(link.node), link.output) for link in links_below(self._root))

    def is_used(self, node: Node, output: str) -> bool:
        """Whether an output feeds anything."""
        return (id(node), output) in self._used

    def share(self, key: Hashable, make: Callable[[], Value]) -> Value:
        """Return what is known by a key, such as the id of a node, made once."""
        if key not in self._shared:
            self._shared[key] = make()
        return self._shared[key]

    def choice(self, node: Node, name: str, default: Any) -> Any:
        """Return one of the node's own choices."""
        return node.properties.get(name, default)

    def _at(self, node: Node, socket: str, default: Socket, kind: str) -> Value:
        found = node.inputs.get(socket, default)
        if isinstance(found, Link):
            made = self._linked(node, socket, found)
            if made is not None:
                return made
            found = found.default
        return self._plain(node, socket, default if found is None else found, kind)

    def _linked(self, node: Node, socket: str, link: Link) -> Value | None:
        """Return what a link brings to an input, None and a note if its node is not known."""
        made = None if (id(node), socket) in self._circles else self._output(link)
        if made is None:
            self.note(
                f"{title(link.node)} feeding {socket} of {title(node)} is replaced by the "
                "input's own value"
            )
        return made

    def _plain(self, node: Node, socket: str, found: Socket, kind: str) -> Value:
        given: Any = found
        is_many, most = isinstance(given, (tuple, list)), float(LARGEST)
        numbers = [float(number) for number in (given[:3] or (np.nan,) if is_many else (given,))]
        if not all(-most <= number <= most for number in numbers):
            self.note(f"{socket} of {title(node)} is {found}, which is no number to draw with")
            numbers = list(np.nan_to_num(numbers).clip(-most, most))
        if is_many:
            return constant(tuple(numbers), COLOUR if kind == FLOAT else kind)
        return value(numbers[0])

    def _output(self, link: Link) -> Value | None:
        """Return the value of an output, None if its node is not known.

        What feeds it is made first, from the far end on: a long chain needs no deep recursion.  A
        link that closes a circle does not count.
        """
        stack, begun = [link], set[tuple[int, str]]()
        while stack:
            node, output = stack[-1].node, stack[-1].output
            if (id(node), output) in self._known:
                stack.pop()
                continue
            function = self._table.get(node.kind)
            begun.add((id(node), output))
            waiting = []
            for socket, found in node.inputs.items() if function is not None else ():
                key = (id(found.node), found.output) if isinstance(found, Link) else None
                if key in begun and key not in self._known:
                    self._circles.add((id(node), socket))
                elif isinstance(found, Link) and key not in self._known:
                    waiting.append(found)
            if waiting:
                stack.extend(waiting)
                continue
            made = None if function is None else function(self, node, output)
            self._known[id(node), output] = made
            stack.pop()
        return self._known[id(link.node), link.output]


def links_below(root: Node | None) -> Iterator[Link]:
    """Yield all links below a node."""
    seen: set[int] = set()
    stack = [] if root is None else [root]
    while stack:
        node = stack.pop()
        if id(node) in seen:
            continue
        seen.add(id(node))
        for found in node.inputs.values():
            if isinstance(found, Link):
                yield found
                stack.append(found.node)


def images_below(root: Node | None) -> Iterator[ImageSource]:
    """Yield the sources of images that nodes below a node show."""
    for link in links_below(root):
        source = link.node.properties.get("image")
        if isinstance(source, ImageSource):
            yield source


def output_of(material: Material) -> Node:
    """Return a node that is fed by all that a material consists of."""
    inputs: dict[str, Socket] = {"Displacement": material.displacement}
    if material.surface is not None:
        inputs["Surface"] = Link(material.surface, "Surface")
    inputs |= {f"AOV {name}": Link(node, name) for name, node in material.aovs.items()}
    return Node("Output", material.name, inputs)


def title(node: Node) -> str:
    """Return what a node is called in notes."""
    return f"{node.kind} '{node.name}'" if node.name else node.kind
