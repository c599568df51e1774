"""Sums and products as a graph: equal terms are shared, zeros and ones fall away, and the rest is printed as code."""

from dataclasses import dataclass, field
from typing import Union

Scalar = Union["Node", float]


@dataclass(frozen=True)
class Node:
    """A number that is known when the printed code runs.

    Attributes:
        graph: Where it belongs.
        index: Its place there.
    """

    graph: "Graph"
    index: int

    def __add__(self, other: Scalar) -> Scalar:
        return self.graph.add(self, other)

    __radd__ = __add__

    def __sub__(self, other: Scalar) -> Scalar:
        return self.graph.add(self, self.graph.multiply(other, -1.0))

    def __rsub__(self, other: Scalar) -> Scalar:
        return self.graph.add(other, self.graph.multiply(self, -1.0))

    def __mul__(self, other: Scalar) -> Scalar:
        return self.graph.multiply(self, other)

    __rmul__ = __mul__

    def __neg__(self) -> Scalar:
        return self.graph.multiply(self, -1.0)

    def __rtruediv__(self, other: Scalar) -> Scalar:
        return self.graph.multiply(other, self.graph.named(f"1.0 / {self.graph.name(self)}"))

    def __hash__(self) -> int:
        return hash(self.index)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Node) and other.graph is self.graph and other.index == self.index


@dataclass(eq=False)
class Graph:
    """The terms of one function, in the order in which they are computed."""

    lines: list[str] = field(default_factory=list)
    _known: dict[str, Node] = field(default_factory=dict)
    _negated: dict[int, Node] = field(default_factory=dict)

    def named(self, text: str) -> Node:
        """A number that code computes."""
        if text not in self._known:
            self._known[text] = Node(self, len(self.lines))
            self.lines.append(text)
        return self._known[text]

    def name(self, number: Scalar) -> str:
        """How printed code calls a number."""
        return f"t{number.index}" if isinstance(number, Node) else repr(float(number))

    def add(self, a: Scalar, b: Scalar) -> Scalar:
        """Sum of two numbers."""
        if not isinstance(a, Node) and not isinstance(b, Node):
            return a + b
        if not isinstance(a, Node) and a == 0.0:
            return b
        if not isinstance(b, Node) and b == 0.0:
            return a
        if isinstance(a, Node) and isinstance(b, Node):
            if self._negated.get(a.index) == b or self._negated.get(b.index) == a:
                return 0.0
            if b.index in self._negated:  # a + (-c) is a - c
                return self.named(f"{self.name(a)} - {self.name(self._negated[b.index])}")
            if a.index in self._negated:
                return self.named(f"{self.name(b)} - {self.name(self._negated[a.index])}")
        return self.named(" + ".join(sorted((self.name(a), self.name(b)))))

    def multiply(self, a: Scalar, b: Scalar) -> Scalar:
        """Product of two numbers."""
        if not isinstance(a, Node):
            return self._scaled(b, a) if isinstance(b, Node) else a * b
        if not isinstance(b, Node):
            return self._scaled(a, b)
        signs = [number.index in self._negated for number in (a, b)]
        a, b = self._negated.get(a.index, a), self._negated.get(b.index, b)
        both = self.named(" * ".join(sorted((self.name(a), self.name(b)))))
        return self._negative(both) if signs[0] != signs[1] else both

    def _scaled(self, a: Node, factor: float) -> Scalar:
        if factor == 0.0:
            return 0.0
        if factor == 1.0:
            return a
        if factor == -1.0:
            return self._negative(a)
        if a.index in self._negated:
            return self._scaled(self._negated[a.index], -factor)
        return self.named(f"{self.name(a)} * {factor!r}")

    def _negative(self, a: Node) -> Node:
        if a.index in self._negated:
            return self._negated[a.index]
        negative = self.named(f"-{self.name(a)}")
        self._negated[negative.index] = a
        return negative

    def printed(self, results: dict[str, Scalar]) -> list[str]:
        """Statements that compute what the results need, then the results: `{target: number}`."""
        needed: set[int] = set()
        todo = [number.index for number in results.values() if isinstance(number, Node)]
        while todo:
            index = todo.pop()
            if index not in needed:
                needed.add(index)
                todo += self._used(index)
        terms = [f"t{i} = {self.lines[i]}" for i in sorted(needed)]
        return terms + [f"{target} {self.name(number)}" for target, number in results.items()]

    def _used(self, index: int) -> list[int]:
        words = self.lines[index].replace("-", " ").split()
        return [int(word[1:]) for word in words if word[0] == "t" and word[1:].isdigit()]
