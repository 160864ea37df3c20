"""Costs of stored results as ratios to the yardstick of the same run, which two versions or machines can be compared by."""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple, cast


class Ratio(NamedTuple):
    """Path of a cost within a result, its parts between slashes, `*` for each; over the yardstick's, which takes the same.

    Without `over` the result has the ratio itself. `gain`: more is better.
    """

    cost: str
    over: str = ""
    gain: bool = False


RATIOS: dict[str, tuple[Ratio, ...]] = {
    "composed": (Ratio("rows/*/over_by_hand"),),
    "door": (Ratio("rows/*/door/p50_us", "rows/*/loopback/p50_us"),),
    "first_start": (
        Ratio("rows/*/strike_processor_s", "imports_s"), Ratio("rows/*/sound_processor_s", "imports_s"),
    ),
    "lateness": (Ratio("rows/*/ratio/p50"), Ratio("rows/*/ratio/p99")),
    "listeners": (
        Ratio("profiles/*/rows/*/router_cpu_us_per_delivery", "profiles/*/rows/0/router_cpu_us_per_delivery"),
    ),
    "mallet": tuple(
        Ratio(f"step_ns/{head}, {tip} touches", f"step_ns/{head}, strikes")
        for head in ("roll", "tom", "roll on modes")
        for tip in ("wood", "felt")
    ),
    "mesh_kernel": (Ratio("effects/*/ratio"), Ratio("kernels/*/gcc_over_ours", gain=True)),
    "mesh_peers": (Ratio("times_ours/*/*/median", gain=True),),
    "modal_bank": (Ratio("lanes/*/*/ns/ratio", gain=True), Ratio("lanes/*/*/pulses/ratio", gain=True)),
    "panel_cost": (Ratio("share_of_core/*/web_panel", "share_of_core/nobody/web_panel"),),
    "panel_stage": (Ratio("ratio"),),
    "sound_cost": (Ratio("rows/*/ratio_to_numpy_slices"),),
    "start_and_restart": (Ratio("rows/*/to_imports"),),
    "step_cost": (Ratio("races/*/ratio"), Ratio("alone/*/with_ns", "alone/*/without_ns")),
    "stick_methods": (Ratio("against_scipy/*/ratio", gain=True),),
    "streamed_force": (
        Ratio("cost/tick, streamed, ns", "cost/tick, analytic, ns"),
        Ratio("cost/mesh step, stream plays, ns", "cost/mesh step, analytic, ns"),
    ),
    "tick_cost": (Ratio("rows/*/ratio_to_bare"),),
    "wire": (
        Ratio("latency/osc/p50_us", "latency/bare/p50_us"), Ratio("latency/zenoh/p50_us", "latency/bare/p50_us"),
    ),
}  # fmt: skip


def _items(value: Any) -> list[tuple[str, Any]]:
    if isinstance(value, Mapping):
        return list(cast("Mapping[str, Any]", value).items())
    return [(str(at), each) for at, each in enumerate(value)]


def _found(
    value: Any, parts: list[str], stars: tuple[str, ...] = ()
) -> Iterator[tuple[tuple[str, ...], Any]]:
    # What stands at the path, with what each star was; nothing where there is no such path.
    if not parts:
        yield stars, value
        return
    for name, inner in _items(value) if isinstance(value, Mapping | list) else ():
        if parts[0] in ("*", name):
            yield from _found(inner, parts[1:], (*stars, name) if parts[0] == "*" else stars)


def _filled(path: str, stars: tuple[str, ...]) -> list[str]:
    given = iter(stars)
    return [next(given) if part == "*" else part for part in path.split("/")]


def ratios(name: str, result: Mapping[str, Any]) -> dict[str, tuple[float, bool]]:
    """Path of each cost that is compared -> its ratio, and whether more of it is better. Empty for a result without yardstick."""
    found: dict[str, tuple[float, bool]] = {}
    for each in RATIOS.get(name, ()):
        for stars, cost in _found(result, each.cost.split("/")):
            over = (
                next((value for _, value in _found(result, _filled(each.over, stars))), None)
                if each.over
                else 1.0
            )
            if cost and over:  # a cost of none, as of nobody's listener, is no ratio
                found["/".join(_filled(each.cost, stars))] = (cost / over, each.gain)
    return found
