"""Cramer-Rao bounds: what no unbiased estimate from fifteen readings can do better than, for the firmware's model of a touch.

The model is that of common/pad_profile.h with the elongations of fit_tangential.c: eight unknowns (normal force, location, own spread, two
elongations per force, tangential force), of which the touch has the profile's spread, no elongation and the true rest. The inverse of the
information of independent normal errors bounds their covariance.
"""

import numpy as np
from contacts import FORCE_N, terms_of

# As fit_tangential.c has them: how much wider the tangential force is spread than the normal one, and the prior.
KAPPA, ELONGATION_SD_mm2 = 1.3, 3.0
CERTAIN_mm2 = 1e-4  # leaves no elongation open
FORCE, X, Y, SPREAD, STRETCH, SLANT, TANGENTIAL_X, TANGENTIAL_Y = range(8)
NOTHING, PRIORS, ROUND = "nothing", "priors", "round"  # known beforehand; the second as the firmware has them, the third and no elongation
# name, what is known, whether gains have errors, the model's error as a share of the peak
LIMITS = (
    ("noise", NOTHING, False, 0.0),
    ("noise, gains", NOTHING, True, 0.0),
    ("noise, model 0.1 %", NOTHING, False, 0.001),
    ("noise, model 0.3 %", NOTHING, False, 0.003),
    ("noise, model 1 %", NOTHING, False, 0.01),
    ("noise; priors", PRIORS, False, 0.0),
    ("noise, gains; priors", PRIORS, True, 0.0),
    ("noise, model 0.1 %; priors", PRIORS, False, 0.001),
    ("noise, model 0.3 %; priors", PRIORS, False, 0.003),
    ("noise, model 1 %; priors", PRIORS, False, 0.01),
    ("noise, gains, model 0.1 %; priors", PRIORS, True, 0.001),
    ("noise, gains, model 0.1 %; known round", ROUND, True, 0.001),
)


def model_Pa(profile, unknowns, x_mm, y_mm):
    """[touch][location] of the unknowns [touch][8] in N and mm."""
    u = unknowns.T[:, :, None]
    dx, dy = x_mm - u[X], y_mm - u[Y]
    square = dx * dx + dy * dy
    elongation = 0.5 * u[STRETCH] * (dx * dx - dy * dy) + u[SLANT] * dx * dy
    total = 0.0
    for share, sd_mm in terms_of(profile["normal"]):
        v = sd_mm * sd_mm + u[SPREAD]
        total = total + u[FORCE] * (1.0 + elongation / (v * v)) * share / (2.0 * np.pi * v) * np.exp(-0.5 * square / v)
    for moment_mm, sd_mm in terms_of(profile["tangential"]):
        v = sd_mm * sd_mm + KAPPA * u[SPREAD]
        along = u[TANGENTIAL_X] * dx + u[TANGENTIAL_Y] * dy
        total = total + along * moment_mm / (2.0 * np.pi * v * v) * np.exp(-0.5 * square / v)
    return 1e6 * total


def bounds(contacts, layer_mm, touch, noise_Pa, gain_sd, model_share, known):
    """Covariances [touch][2][2] of Q / F and of the location. gain_sd: [touch][sensor] or 0; model_share: of the peak."""
    profile, sensors_mm = contacts.pad_profile(layer_mm)[0], (contacts.x_mm, contacts.y_mm)
    at = np.zeros((len(touch), 8))
    at[:, [FORCE, X, Y]] = np.stack([touch["force_N"], touch["x_mm"], touch["y_mm"]], axis=1)
    at[:, SPREAD] = profile["spread_mm2"]
    alone = at.copy()
    at[:, [TANGENTIAL_X, TANGENTIAL_Y]] = np.stack([touch[name] for name in FORCE_N], axis=1)
    peak_Pa = model_Pa(profile, alone, alone[:, [X]], alone[:, [Y]])
    readings_Pa = model_Pa(profile, at, *sensors_mm)
    variance = noise_Pa**2 + (gain_sd * readings_Pa) ** 2 + (model_share * peak_Pa) ** 2
    step = 1e-4  # of unknowns of 1 to 10: the error is 1e-8 of the slope
    slopes = [
        (model_Pa(profile, at + move, *sensors_mm) - model_Pa(profile, at - move, *sensors_mm)) / (2.0 * step) for move in step * np.eye(8)
    ]
    slopes = np.stack(slopes, axis=2) / np.sqrt(variance)[:, :, None]
    information = slopes.transpose(0, 2, 1) @ slopes
    if known != NOTHING:
        sds = {SPREAD: float(profile["spread_sd_mm2"])} | dict.fromkeys(
            (STRETCH, SLANT), CERTAIN_mm2 if known == ROUND else ELONGATION_SD_mm2
        )
        for k, sd in sds.items():
            information[:, k, k] += 1.0 / sd**2
    # Scaled to a diagonal of ones: forces and squares of millimetres are far apart.
    scale = 1.0 / np.sqrt(np.einsum("nii->ni", information))
    scale = scale[:, :, None] * scale[:, None, :]
    covariance = scale * np.linalg.inv(scale * information)
    ratio = np.zeros((len(touch), 2, 8))
    for k, tangential in enumerate((TANGENTIAL_X, TANGENTIAL_Y)):
        ratio[:, k, tangential] = 1.0 / touch["force_N"]
        ratio[:, k, FORCE] = -at[:, tangential] / touch["force_N"] ** 2
    return ratio @ covariance @ ratio.transpose(0, 2, 1), covariance[:, X : Y + 1, X : Y + 1]
