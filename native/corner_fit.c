/* The steps of a fit, and corner after corner. */

#include <math.h>
#include <stddef.h>
#include <string.h>

#include "corner_kernel.h"
#include "exported.h"

/* Of the amplitude: grey levels that change by more have not been judged yet. */
#define SETTLED 0.05
/* Of the last step: a step back that is longer has overshot, and from then on steps are halved. */
#define MOST_SWING 0.5

/* px: from places on this grid single precision holds the distance of every pixel, below 32 px, to the last bit. */
#define GRID (1.0 / (1 << 19))

static void put_on_grid(double *p) {
    p[AT_X] = rint(p[AT_X] / GRID) * GRID;
    p[AT_Y] = rint(p[AT_Y] / GRID) * GRID;
}

/* How far the corner goes. */
static double length(const double *step) { return sqrt(step[AT_X] * step[AT_X] + step[AT_Y] * step[AT_Y]); }

/* The fraction of a step within which the model is nearly linear. */
static double trusted_part(const double *p, const double *step) {
    double fraction = lesser(1.0, 1.5 / length(step));
    fraction = lesser(fraction, 0.3 / greater(fabs(step[ANGLE_1]), fabs(step[ANGLE_2])));
    return lesser(fraction, 0.6 * p[BLUR] / fabs(step[BLUR]));
}

/* Go a fraction of a step, which becomes what was gone. */
static void take(double *p, double *step, double fraction) {
    for (int k = 0; k < PARAMETERS; k++)
        step[k] *= fraction;
    step[BLUR] = greater(step[BLUR], SHARPEST_PX - p[BLUR]);
    for (int k = 0; k < PARAMETERS; k++)
        p[k] += step[k];
}

static void take_half_back(double *p, double *step) {
    for (int k = 0; k < PARAMETERS; k++) {
        step[k] *= 0.5;
        p[k] -= step[k];
    }
}

/* Gauss-Newton's method, a step halved until the misfit falls; the status. */
static int fit(const Image *image, double *p, const double *bends, const double *size, double tolerance, int most_steps,
               Window *window, Factor factor) {
    double best = INFINITY, calm = 1.0, step[PARAMETERS] = {0.0};
    Normal normal;
    for (int steps = 0; steps < most_steps; steps++) {
        put_on_grid(p);
        if (!gather(image, p, size, window) || window->count < 3 * PARAMETERS)
            return OUTSIDE;
        double weight = differentiate(p, bends, size, window);
        accumulate(window, normal);
        double misfit = normal[PARAMETERS][PARAMETERS] / weight;
        if (misfit > 1.1 * best) { /* not just more: as the window moves along, the root is not quite the minimum */
            take_half_back(p, step);
            continue;
        }
        best = lesser(best, misfit);
        expect(p, misfit, normal);
        if (!factorise(normal, factor))
            return FAILED;
        double last_x = step[AT_X], last_y = step[AT_Y];
        memcpy(step, normal[PARAMETERS], sizeof(step));
        solve(factor, step);
        if (step[AT_X] * last_x + step[AT_Y] * last_y < -MOST_SWING * (last_x * last_x + last_y * last_y))
            calm *= 0.5;
        int close = length(step) < tolerance && fabs(step[BLUR]) < 10 * tolerance &&
                    fabs(step[A]) + fabs(step[B]) < SETTLED * fabs(p[B]);
        take(p, step, calm * trusted_part(p, step));
        if (close) {
            take_from_residuals(window, step);
            return CONVERGED;
        }
    }
    return FAILED;
}

/* Fit corner after corner, in place.
 *
 * image       height rows of width pixels, of as many bytes as said
 * white       grey level from which on a pixel is saturated
 * count       of corners
 * parameters  (count, PARAMETERS) in: where to begin; out: what was found
 * bends       (count, 2) 1/px, curvature of each edge
 * sizes       (count, 4) px: half the window along each edge; how far from an edge, in the direction of the other,
 *             pixels count at all
 * tolerance   of the place, px; above the grid
 * examine     whether all that is found is wanted, not only the status
 * found       (count, DIAGNOSTICS) in: zeros
 */
EXPORTED void fit_corners(const void *image, int32_t bytes, int64_t height, int64_t width, double white, int64_t count,
                          double *parameters, const double *bends, const double *sizes, double tolerance,
                          int32_t most_steps, int32_t examine, double *found) {
    const Image whole = {bytes == 1 ? image : NULL, bytes == 2 ? image : NULL, height, width};
    Window window;
    Factor factor;
    for (int64_t c = 0; c < count; c++) {
        double *p = parameters + c * PARAMETERS, *result = found + c * DIAGNOSTICS;
        int status = fit(&whole, p, bends + 2 * c, sizes + 4 * c, tolerance, most_steps, &window, factor);
        result[STATUS] = status;
        if (examine && status == CONVERGED) {
            examine_place(p, &window, factor, result);
            examine_quarters(p, &window, white, result);
            examine_opposites(p, &window, result);
        }
    }
}
