/* The settings a fingertip starts with. Commands change those that PROTOCOL.md lists. */
#pragma once

#ifdef FINGERTIP_SCENE_PAPER
#define DEFAULT_RATE_mHz 20000u /* the paper reads at 20 Hz */
#else
#define DEFAULT_RATE_mHz 0u /* as fast as the sensors allow */
#endif

#define DEFAULT_OSR 1024u

/* Paper, section IV.D: n = 2 steps at 20 Hz is 0.1 s, threshold 0.75 mm. */
#define DEFAULT_SLIP_WINDOW_ms 100u
#define DEFAULT_SLIP_THRESHOLD_mm 0.75f

#define DEFAULT_FIT_ITERATIONS FINGERTIP_FIT_ITERATIONS

/* A Gaussian is never negative, but rubber is: it bulges beside a contact, and sensors three to five sigma away read -1 to -2 % of the peak
 * (host_tools/report/real). Such a reading counts as zero from this number of noise sd below it. A tangential force makes readings negative
 * too, so where a pad's profile is in use they stay as they are. The paper's scene keeps the paper's fit. */
#ifdef FINGERTIP_SCENE_PAPER
#define DEFAULT_CLIP_BELOW_SDS 0u
#define DEFAULT_USES_SHAPE 0
#else
#define DEFAULT_CLIP_BELOW_SDS 4u
#define DEFAULT_USES_SHAPE 1 /* that a calibration found */
#endif

/* Force over 2 pi p0 sigma^2 of a pad that was never calibrated. A contact's tails are not Gaussian, and the missing
 * force depends on the layer: the product holds 0.90 to 0.97 of it on 6 to 12 mm of rubber (the twin's validation). On
 * four real pads under what was hung on them it read 0.28, 1.0, 2.5 and 2.6 times of it: rubber and its skin pass on
 * more or less of a press. So newtons without a weight are an order of size. */
#define DEFAULT_FORCE_SCALE 1.0f
#define DEFAULT_FORCE_SCALE_SD 0.8f

/* UNCERTAIN where the location's standard deviation is above it: FIT_LOCATION_SD_LIMIT_mm. */
#define DEFAULT_LOCATION_LIMIT_mm 0.6f

/* Width 0 is no prior. */
#define DEFAULT_PRIOR_SIGMA_mm (0.001f * FINGERTIP_PRIOR_SIGMA_UM)
#define DEFAULT_PRIOR_WIDTH_mm (FINGERTIP_PRIOR_SIGMA_UM > 0 ? 0.001f * FINGERTIP_PRIOR_WIDTH_UM : 0.0f)

/* Relative standard deviation of a sensor's gain, on a pad that was never calibrated. The gains of a real strip of four
 * barometers under rubber differ by +-10 % (JiannnH/MTL-BaroTactileSensor, Imperial College London, 2023). To take that
 * as one standard deviation is the stricter reading. Four sensors hardly determine it, so this is a twentieth more. The
 * twentieth takes bad locations without a warning from 1.4 to 1.2 % of the touches (report truth, part fit). */
#define DEFAULT_GAIN_SD 0.105f
/* Error of the Gaussian for a layer of rubber, as a share of the largest reading. With it one
 * standard deviation covers 57 to 74 % of the errors on pads of 6 and 12 mm (report truth, part fit). */
#define DEFAULT_MODEL_SD 0.0065f
