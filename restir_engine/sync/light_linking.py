"""Light and shadow linking: which emitters light which objects, and which block them, as sets and bits for kernels."""

from __future__ import annotations

import bpy

from ..kernels.core.records import BLOCKER_SETS


class Rule:
    """What one collection says, children first: an object's own entry wins over that of a child."""

    def __init__(self, collection: bpy.types.Collection) -> None:
        self.included: dict[int, bool] = {}
        for child, entry in zip(collection.children, collection.collection_children, strict=True):
            self._note(child.all_objects, entry)
        for item, entry in zip(collection.objects, collection.collection_objects, strict=True):
            self._note([item], entry)
        self._others = not any(self.included.values())

    def _note(self, items, entry) -> None:
        for item in items:
            self.included[item.original.as_pointer()] = entry.light_linking.link_state == "INCLUDE"

    def __len__(self) -> int:
        return len(self.included)

    def links(self, owners: tuple[int, ...]) -> bool:
        """Whether an object is linked; owners: who its entry may be found under, the first that has one counts."""
        return next((self.included[owner] for owner in owners if owner in self.included), self._others)


class Linking:
    """The rules of a scene's emitters, and the sets of objects that they tell apart, so many at most.

    name: of the collection in an object's settings of light linking.
    """

    def __init__(self, name: str, most: int) -> None:
        self._name, self.most = name, most
        self.rules: list[Rule] = []
        self._by_collection: dict[int, int] = {}

    def rule_of(self, item: bpy.types.Object) -> int:
        """The number of an emitter's rule, -1: everything is linked."""
        collection = getattr(item.light_linking, self._name)
        if collection is None:
            return -1
        key = collection.original.as_pointer()
        if key not in self._by_collection:
            rule = Rule(collection.original)
            self._by_collection[key] = len(self.rules) if len(rule) else -1
            self.rules += [rule] if len(rule) else []
        return self._by_collection[key]

    def resolve(self, owners: list[tuple[int, ...]]) -> tuple[list[int], list[int], bool]:
        """(light set of each object, bits of each rule, whether there were more sets than there can be).

        Set 0 is that of objects which no rule knows; objects beyond the last set are taken for such.
        """
        sets: dict[tuple[bool, ...], int] = {tuple(rule.links(()) for rule in self.rules): 0}
        crowded, found = False, []
        for each in owners:
            linked = tuple(rule.links(each) for rule in self.rules)
            if linked not in sets and len(sets) == self.most:
                crowded = True
            else:
                sets.setdefault(linked, len(sets))
            found.append(sets.get(linked, 0))
        bits = [sum(1 << number for linked, number in sets.items() if linked[k]) for k in range(len(self.rules))]
        return found, [each - (1 << 64) if each >> 63 else each for each in bits], crowded


def receivers() -> Linking:
    """What light reaches; as many sets as Cycles has."""
    return Linking("receiver_collection", 64)


def blockers() -> Linking:
    """What light is blocked by."""
    return Linking("blocker_collection", BLOCKER_SETS)


def owners(instance) -> tuple[int, ...]:
    """Who the entries of an instance may be found under: its instancer, then the object itself."""
    item = (instance.instance_object or instance.object).original.as_pointer()
    return (instance.parent.original.as_pointer(), item) if instance.parent is not None else (item,)
