"""results -> text.  The tables that the benchmark prints."""

from typing import Any

VERDICTS = {True: "reached", False: "not reached", None: "not measured"}


def print_scene(result: dict[str, Any]) -> None:
    """Print one scene: its points by engine, then the stages of Penumbra."""
    width, height = result["size"]
    print(f"\n{result['name']}  {width} x {height}")
    print("  engine    samples  seconds  Msamples/s     relMSE   trimmed       RMSE  mean diff.")
    for engine, points in result["engines"].items():
        for point in points:
            at = point.get("threshold", point["samples"])
            speed = point.get("samples_per_second")
            line = f"  {engine.title():9s} {at:7} {point['seconds']:8.3f}"
            line += f" {speed / 1e6:11.3f}" if speed else "          - "
            if "error" in point:
                e, star = point["error"], " *" if point["limited_by_reference"] else ""
                line += f" {e['relmse']:10.2e} {e['relmse_trimmed']:9.2e} {e['rmse']:10.2e}"
                line += f" {100 * point['mean_difference']:+8.3f} %{star}"
            print(line)
    if any(p.get("limited_by_reference") for points in result["engines"].values() for p in points):
        print("  * below the noise of the reference, which is subtracted: not reliable")
    last = result["engines"]["PENUMBRA"][-1]
    if "ns_per_vertex" in last:
        stages = "  ".join(f"{name} {ns:.0f}" for name, ns in last["ns_per_vertex"].items())
        print(f"  Penumbra, ns of one thread per path vertex: {stages}")
        s = last["statistics"]
        print(
            f"  Penumbra, seconds: export {s['export_seconds']:.3f}  compile "
            f"{s['compile_seconds']:.3f}  build {s['build_seconds']:.3f}  sampling "
            f"{s['sampling_seconds']:.3f}"
        )


def print_latency(found: dict[str, dict[str, float]]) -> None:
    """Print how long a user of the viewport waits, in milliseconds."""
    print("\nms until something is seen")
    for scene, row in found.items():
        print(f"{scene:16s}" + "  ".join(f"{what} {1e3 * s:.0f}" for what, s in row.items()))


def print_summary(results: list[dict[str, Any]]) -> None:
    """Print how many times longer Cycles takes."""
    print("\nCycles' time / Penumbra's       equal error (relMSE)    trimmed       RMSE  target")
    print("scene            equal samples  mean (least..most)")
    for result in results:
        ratio = result["ratio"]
        line, note = f"{result['name']:16s} {ratio['equal_samples']:13.2f}", ""
        if "relmse" in ratio:
            r = ratio["relmse"]
            line += f"  {r['ratio']:.2f} ({r['smallest']:.2f}..{r['largest']:.2f})".ljust(24)
            line += "".join(
                f"{ratio[m]['ratio']:11.2f}" if m in ratio else "          -"
                for m in ("relmse_trimmed", "rmse")
            )
            if any(r["method"] == "extrapolated" for m, r in ratio.items() if m != "equal_samples"):
                note = "  extrapolated"
        if result["target"] is not None:
            line = f"{line:74s}{result['target']:6.1f} {VERDICTS[result['reached']]}"
        print(line + note)
