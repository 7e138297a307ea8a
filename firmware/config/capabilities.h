/* What this build can do, 0 or 1 each: cmake/options.cmake sets them, by scene or one by one. What
 * is off is not compiled: it leaves no symbol, no variable and no field of a packet.
 */
#ifndef CONFIG_CAPABILITIES_H
#define CONFIG_CAPABILITIES_H

/* Location, force and the contact packets. */
#ifndef FT_WITH_FIT
#define FT_WITH_FIT FINGERTIP_FIT
#endif

/* Fits of any layout; without it only of the rectangle that the fixed-point kernels take (fit.h). */
#ifndef FT_WITH_FIT_GENERAL
#define FT_WITH_FIT_GENERAL FINGERTIP_FIT_GENERAL
#endif

/* Slip, and the command that sets it. */
#ifndef FT_WITH_SLIP
#define FT_WITH_SLIP FINGERTIP_SLIP
#endif

/* The kernel for full rectangles: faster, and with separate widths and ELONGATED (fit.h). Without
 * it, that for missing sensors fits all frames. */
#ifndef FT_WITH_FULL_GRID
#define FT_WITH_FULL_GRID FINGERTIP_FULL_GRID
#endif

/* The search for a sensor whose reading does not belong to the others'. Builds with
 * FT_WITH_FIT_GENERAL have it always. */
#ifndef FT_WITH_OUTLIERS
#define FT_WITH_OUTLIERS FINGERTIP_OUTLIERS
#endif

/* Tangential force, and the commands that bring and erase the pad's profile. */
#ifndef FT_WITH_TANGENTIAL
#define FT_WITH_TANGENTIAL FINGERTIP_TANGENTIAL
#endif

/* What a tangential force that is not estimated does to the standard deviation of the location
 * (fit_doubt.h), and learning from touches how far gains are apart (fit_gains.h). */
#ifndef FT_WITH_TANGENTIAL_DOUBT
#define FT_WITH_TANGENTIAL_DOUBT FINGERTIP_TANGENTIAL_DOUBT
#endif

/* Contact shapes: two contacts, edges (fit_shapes.h). */
#ifndef FT_WITH_SHAPES
#define FT_WITH_SHAPES FINGERTIP_SHAPES
#endif

/* The raw packets. */
#ifndef FT_WITH_RAW_STREAM
#define FT_WITH_RAW_STREAM FINGERTIP_RAW_STREAM
#endif

/* The sync pin, its packets, and the command that sets it. */
#ifndef FT_WITH_SYNC
#define FT_WITH_SYNC FINGERTIP_SYNC
#endif

#if FT_WITH_SLIP && !FT_WITH_FIT
#error "slip is found from fits: switch FINGERTIP_FIT on too"
#endif
#if FT_WITH_TANGENTIAL && !FT_WITH_FIT
#error "tangential force is found from fits: switch FINGERTIP_FIT on too"
#endif
#if (FT_WITH_FULL_GRID || FT_WITH_OUTLIERS || FT_WITH_TANGENTIAL_DOUBT) && !FT_WITH_FIT
#error "these are parts of the fit: switch FINGERTIP_FIT on too"
#endif
#if FT_WITH_SHAPES && !FT_WITH_TANGENTIAL
#error "contact shapes need the pad's profile: switch FINGERTIP_TANGENTIAL on too"
#endif
#if !FT_WITH_FIT && !FT_WITH_RAW_STREAM
#error "nothing would be streamed: switch FINGERTIP_FIT or FINGERTIP_RAW_STREAM on"
#endif

#endif
