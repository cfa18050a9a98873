"""results -> text.  The tables that the benchmark prints."""

from typing import Any

VERDICTS = {True: "reached", False: "not reached", None: "not measured"}


def print_scene(result: dict[str, Any]) -> None:
    """Print one scene: its points by contender, then the stages of Penumbra."""
    width, height = result["size"]
    wide = max(9, *map(len, result["engines"]))
    print(f"\n{result['name']}  {width} x {height}")
    print(
        f"  {'':{wide}s} samples  seconds  Msamples/s     relMSE   trimmed       RMSE    FLIP"
        "  mean diff."
    )
    for name, points in result["engines"].items():
        for point in points:
            print(f"  {name:{wide}s} {_point(point)}")
    if any(p.get("limited_by_reference") for points in result["engines"].values() for p in points):
        print("  * below the noise of the reference, which is subtracted: not reliable")
    for name, why in result["absent"].items():
        print(f"  without {name}: {why}")
    last = result["engines"]["PENUMBRA"][-1]
    if "ns_per_vertex" in last:
        stages = "  ".join(f"{name} {ns:.0f}" for name, ns in last["ns_per_vertex"].items())
        print(f"  Penumbra, ns of one thread per path vertex: {stages}")
    for name, points in result["engines"].items():
        if points[-1]["parts"]:
            parts = "  ".join(f"{part} {s:.3f}" for part, s in points[-1]["parts"].items())
            print(f"  {name}, seconds: {parts}")


def _point(point: dict[str, Any]) -> str:
    at, speed = point.get("threshold", point["samples"]), point.get("samples_per_second")
    line = f"{at:7} {point['seconds']:8.3f}"
    line += f" {speed / 1e6:11.3f}" if speed else "          - "
    if "error" in point:
        e, star = point["error"], " *" if point["limited_by_reference"] else ""
        line += f" {e['relmse']:10.2e} {e['relmse_trimmed']:9.2e} {e['rmse']:10.2e}"
        line += f" {e['flip']:7.4f}" if "flip" in e else "       -"
        line += f" {100 * point['mean_difference']:+8.3f} %{star}"
    return line


def print_latency(found: dict[str, dict[str, float]]) -> None:
    """Print how long a user of the viewport waits, in milliseconds."""
    print("\nms until something is seen")
    for scene, row in found.items():
        print(f"{scene:16s}" + "  ".join(f"{what} {1e3 * s:.0f}" for what, s in row.items()))


def print_summary(results: list[dict[str, Any]]) -> None:
    """Print how many times longer Cycles takes than Penumbra, and than its variants."""
    print(
        "\nCycles' time / Penumbra's           equal error (relMSE)    trimmed       RMSE  target"
    )
    print("scene                equal samples  mean (least..most)")
    for result in results:
        line, note = _ratio(result["name"], result["ratio"]), _note(result["ratio"])
        if result["target"] is not None:
            line = f"{line:78s}{result['target']:6.1f} {VERDICTS[result['reached']]}"
        print(line + note)
        for name, ratio in result["ratios"].items():
            if name != "PENUMBRA" and ratio:
                print(_ratio("  " + name, ratio) + _note(ratio))


def _ratio(name: str, ratio: dict[str, Any]) -> str:
    same = f"{ratio['equal_samples']:13.2f}" if "equal_samples" in ratio else f"{'-':>13s}"
    line = f"{name:20s} {same}"
    if "relmse" in ratio:
        r = ratio["relmse"]
        line += f"  {r['ratio']:.2f} ({r['smallest']:.2f}..{r['largest']:.2f})".ljust(24)
        line += "".join(
            f"{ratio[m]['ratio']:11.2f}" if m in ratio else "          -"
            for m in ("relmse_trimmed", "rmse")
        )
    return line


def _note(ratio: dict[str, Any]) -> str:
    methods = {r["method"] for metric, r in ratio.items() if metric != "equal_samples"}
    return "  extrapolated" if "extrapolated" in methods else ""
