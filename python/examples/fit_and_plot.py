"""Fits a generator to a recording and draws both: fit_and_plot.py RECORDING PICTURE.png"""

import sys

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

import footfall


def main(recording: str, picture: str) -> None:
    """Prints the error on strides that were not fitted, and writes the picture."""
    fit = footfall.fit(recording)
    if fit.not_used_because:
        sys.exit(fit.not_used_because)
    heldout, floor = fit.heldout_rmse_deg, fit.heldout_floor_deg
    percent = np.arange(200) / 2
    figure, panels = plt.subplots(2, 2, sharex=True, figsize=(9, 6), layout="constrained")
    for joint, (name, panel) in enumerate(zip(footfall.JOINTS, panels.T.flat)):
        panel.plot(percent, np.degrees(fit.strides_rad[:, :, joint]).T, color="0.8", linewidth=0.7)
        panel.plot(percent, np.degrees(fit.mean_stride_rad[:, joint]), color="0.2", label="mean stride of the person")
        panel.plot(percent, np.degrees(fit.generator_stride_rad[:, joint]), "--", color="C1", label="generator")
        title = name.replace("_", " ")
        if heldout is not None and floor is not None:
            print(f"{title}: {heldout[joint]:.3f} degrees on held-out strides, the person's own {floor[joint]:.3f}")
            title += f": {heldout[joint]:.2f} degrees on held-out strides"
        panel.set(title=title, ylabel="angle, deg", xlabel="stride, %")
    panels[0, 0].legend()
    figure.suptitle(f"stride of {fit.stride_s:.3f} s, {len(fit.strides_rad)} strides")
    figure.savefig(picture, dpi=120)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(sys.argv[1], sys.argv[2])
