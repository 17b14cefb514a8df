"""What follows when a worker is lost: nothing but the variant that ended it."""

from __future__ import annotations

from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool

from weavecore.exploring.evaluate import Result
from weavecore.exploring.executors import Crew, Results
from weavecore.exploring.schedule import run_groups
from weavecore.exploring.variants import Group, Variant


def groups_of(n_groups: int, n_variants: int) -> list[Group]:
    return [
        Group(tuple(Variant("s", "d", "None", None, float(g), "plain", 1.0 + v, "gfrp") for v in range(n_variants)))
        for g in range(1, n_groups + 1)
    ]


class FragilePool(Crew):
    """All groups that are there when one with a deadly variant is taken are lost, as in a pool of processes."""

    def __init__(self, deadly: set[str], *, lives: int = 1_000) -> None:
        super().__init__({}, with_pages=False)
        self.capacity = 4
        self.deadly, self.lives, self.restarts, self.is_broken = deadly, lives, 0, False

    def submit(self, group: Group) -> Results:
        if self.is_broken:
            raise BrokenProcessPool("a process ended")
        future: Results = Future()
        keys = [variant.key for variant in group.variants]
        if self.lives and self.deadly.intersection(keys):
            self.lives -= 1
            self.is_broken = True
            future.set_exception(BrokenProcessPool("a process ended"))
        else:
            future.set_result([Result(key) for key in keys])
        return future

    def restart(self) -> None:
        self.restarts += 1
        self.is_broken = False


def keys_of(groups: list[Group]) -> list[str]:
    return sorted(variant.key for group in groups for variant in group.variants)


def test_a_variant_that_ends_its_worker_is_the_only_one_without_a_result() -> None:
    groups = groups_of(6, 3)
    deadly = groups[1].variants[2].key
    results = list(run_groups(groups, FragilePool({deadly})))
    assert sorted(result.key for result in results) == keys_of(groups)
    (lost,) = [result for result in results if result.error]
    assert lost.key == deadly
    assert lost.error.startswith("WORKER_LOST: ")
    assert not lost.is_final


def test_a_worker_that_is_lost_by_chance_costs_no_variant() -> None:
    groups = groups_of(6, 3)
    pool = FragilePool({groups[1].variants[2].key}, lives=1)
    results = list(run_groups(groups, pool))
    assert sorted(result.key for result in results) == keys_of(groups)
    assert [result for result in results if result.error] == []
    assert pool.restarts >= 1


def test_no_more_groups_are_held_than_the_workers_need() -> None:
    taken = []

    class Counting(FragilePool):
        def submit(self, group: Group) -> Results:
            taken.append(group)
            return super().submit(group)

    results = run_groups(groups_of(20, 1), Counting(set()))
    next(results)
    assert len(taken) <= 4
    assert len(list(results)) == 19
