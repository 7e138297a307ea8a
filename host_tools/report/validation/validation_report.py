"""The pictures of what validation.py measured."""

import numpy as np
from fingertip.files import SENSOR_X_mm, SENSOR_Y_mm
from presentation import BLUE, FAINT, INK, ORANGE, plt, save


def draw(curves, folder):
    """validation_force.png, validation_signals.png, validation_slip.png: the names of those that were drawn."""
    drawn = ["validation_force.png"]
    figure, axes = plt.subplots(2, 2, figsize=(11, 7.5), layout="constrained")
    shown = curves["force"]
    for axis, name, title in (
        (axes[0, 0], "taps", "(a) taps, small sphere, dip, calibrated"),
        (axes[0, 1], "object", "(b) ping-pong ball, dip, calibrated"),
    ):
        if name not in shown:
            axis.set_axis_off()
            continue
        axis.plot(shown[name]["time_s"], shown[name]["true_N"], color=ORANGE, label="true")
        axis.plot(shown[name]["time_s"], shown[name]["estimated_N"], ".-", color=BLUE, ms=3, lw=0.8, label="estimated")
        axis.set(title=title, xlabel="time, s", ylabel="force, N")
        axis.legend()
    for name, colour, label in (("dip", ORANGE, "never calibrated"), ("dip calibrated", BLUE, "calibrated")):
        axes[1, 0].plot(shown[name]["true_N"], shown[name]["estimated_N"], ",", color=colour, rasterized=True)
        axes[1, 0].plot([], [], "o", ms=4, color=colour, label=label)
    axes[1, 0].plot((0, 50), (0, 50), color=FAINT, lw=0.8)
    axes[1, 0].legend()
    axes[1, 0].set(title="(c) all samples, gain spread 10 %, dip", xlabel="true force, N", ylabel="estimated force, N")
    if "cycle" in shown:
        axes[1, 1].plot(shown["cycle"]["true_N"], shown["cycle"]["estimated_N"], color=BLUE)
        axes[1, 1].plot((0, 20), (0, 20), color=FAINT, lw=0.8)
        axes[1, 1].set(title="(d) slow load cycle, relaxation and hysteresis", xlabel="true force, N", ylabel="estimated force, N")
    figure.suptitle("Simulated fingertip, as the paper's Fig. 7")
    save(figure, folder / drawn[-1])

    if shown := curves["signals"]:
        figure, axis = plt.subplots(figsize=(11, 4), layout="constrained")
        axis.plot(shown["time_s"], 1e-3 * shown["above_Pa"], lw=0.9)
        other = axis.twinx()
        other.plot(shown["time_s"], shown["true_N"], color=INK, lw=1.2, ls="--")
        other.set_ylabel("true force, N (dashed)")
        axis.set(xlabel="time, s", ylabel="pressure above tare, kPa", title="Readings of the fifteen sensors, simulated")
        drawn.append("validation_signals.png")
        save(figure, folder / drawn[-1])

    if shown := curves["slip"]:
        figure, axes = plt.subplots(1, 5, figsize=(11, 4.2), layout="constrained")
        x_mm, y_mm = np.meshgrid(np.linspace(-15, 15, 120), np.linspace(-25, 25, 200))
        for axis, n in zip(axes, np.linspace(0, len(shown["time_s"]) - 1, 5).astype(int)):
            at = {name: values[n] for name, values in shown.items()}
            squares = (x_mm - at["x_mm"]) ** 2 + (y_mm - at["y_mm"]) ** 2
            image = axis.imshow(
                1e-3 * at["p0_Pa"] * np.exp(-squares / (2 * at["sigma_mm"] ** 2)),
                extent=(-15, 15, -25, 25),
                origin="lower",
                cmap="viridis",
                vmin=0,
            )
            axis.plot(SENSOR_X_mm, SENSOR_Y_mm, "w.", ms=3)
            axis.plot(at["true_x_mm"], at["true_y_mm"], "r+", ms=9)
            axis.set_title(f"{1e3 * (at['time_s'] - shown['time_s'][0]):.0f} ms", fontsize=9)
        figure.colorbar(image, ax=axes, label="kPa", shrink=0.7)
        figure.suptitle("Slip at 20 mm/s, simulated: reconstructed pressure, true place +")
        drawn.append("validation_slip.png")
        save(figure, folder / drawn[-1])
    return drawn
