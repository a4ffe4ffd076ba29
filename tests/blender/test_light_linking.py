"""What collections say of light linking, as sets and bits; pictures are in tests/images."""

import bpy
import pytest

from restir_engine.sync import light_linking
from testing.blender import kit


@pytest.fixture
def cubes():
    kit.reset()
    return [kit.put("cube", kit.diffuse(), (3.0 * x, 0.0, 0.0)) for x in range(4)]


def key(item) -> tuple[int, ...]:
    return (item.original.as_pointer(),)


def linked(items, state="INCLUDE"):
    made = bpy.data.collections.new("linked")
    for item in items:
        made.objects.link(item)
    for entry in made.collection_objects:
        entry.light_linking.link_state = state
    return made


def states(collection, items) -> list[bool]:
    rule = light_linking.Rule(collection)
    return [rule.links(key(item)) for item in items]


def test_included_alone_are_linked(cubes):
    assert states(linked(cubes[:2]), cubes) == [True, True, False, False]


def test_all_but_the_excluded_are_linked(cubes):
    assert states(linked(cubes[:1], "EXCLUDE"), cubes) == [False, True, True, True]


def test_an_objects_own_entry_wins_over_its_collections(cubes):
    parent = linked(cubes[:1], "EXCLUDE")
    child = bpy.data.collections.new("child")
    for cube in cubes[:3]:
        child.objects.link(cube)
    parent.children.link(child)
    assert states(parent, cubes) == [False, True, True, False]


def test_the_instancer_comes_before_the_instanced(cubes):
    rule = light_linking.Rule(linked(cubes[:1], "EXCLUDE"))
    assert rule.links(key(cubes[1]) + key(cubes[0])) is False
    rule = light_linking.Rule(linked(cubes[:1]))
    assert rule.links(key(cubes[1]) + key(cubes[0])) is True


def test_nobody_linked_is_no_rule(cubes):
    lamp = kit.lamp()
    lamp.light_linking.receiver_collection = bpy.data.collections.new("empty")
    assert light_linking.receivers().rule_of(lamp) == -1


def test_sets_and_bits(cubes):
    """Every object is in a set whose bit is what the rules say of it; the same of them share a set."""
    linking = light_linking.receivers()
    lamps = [kit.lamp() for _ in range(3)]
    for lamp, (items, state) in zip(
        lamps, ((cubes[:1], "INCLUDE"), (cubes[:2], "EXCLUDE"), (cubes[1:3], "INCLUDE")), strict=True
    ):
        lamp.light_linking.receiver_collection = linked(items, state)
    assert [linking.rule_of(lamp) for lamp in (*lamps, lamps[0])] == [0, 1, 2, 0]
    sets, bits, crowded = linking.resolve([key(cube) for cube in (*cubes, cubes[0])])
    assert not crowded and sets[4] == sets[0] and sets[3] == 0 and len(set(sets)) == 4
    said = [[bool(each >> number & 1) for number in sets[:4]] for each in bits]
    assert said == [[True, False, False, False], [False, False, True, True], [False, True, True, False]]


def test_more_sets_than_there_can_be_are_told(cubes):
    linking = light_linking.Linking("blocker_collection", 2)
    for cube in cubes[:2]:
        lamp = kit.lamp()
        lamp.light_linking.blocker_collection = linked([cube])
        linking.rule_of(lamp)
    sets, _, crowded = linking.resolve([key(cube) for cube in cubes])
    assert crowded and max(sets) == 1


def test_the_last_of_64_bits(cubes):
    """Records hold signed numbers."""
    linking = light_linking.receivers()
    for k in range(64):
        lamp = kit.lamp()
        lamp.light_linking.receiver_collection = linked([kit.put("cube", None, (0.0, 0.0, 2.0 * k))])
        linking.rule_of(lamp)
    things = [next(iter(rule.included)) for rule in linking.rules]
    sets, bits, crowded = linking.resolve([(thing,) for thing in things])
    assert crowded and sets[:63] == list(range(1, 64)) and sets[63] == 0
    assert bits[62] == -(1 << 63) and bits[0] == 2
