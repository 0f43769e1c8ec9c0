/* The image of a corner, a + b u v, and its derivatives.
 *
 * u and v are the profiles, from -1 to 1, of two edges that cross in the corner: a step seen through a Gaussian of
 * deviation s. What the product lacks is added to first order: for the pixel's own area, which is no Gaussian, by the
 * Gram-Charlier series with the fourth cumulant of a box; for edges that are not perpendicular, by the tetrachoric
 * series of the bivariate normal distribution. Edges may be bent, by a curvature that is given. a and b have gradients:
 * light that changes across the board scales both, a reflection is added.
 */

#include <math.h>
#include <string.h>

#include "corner_kernel.h"
#include "exported.h"

typedef struct {
    double value, slope;
} Profile;

/* The image of an edge (-1 to 1) and its derivative, at z deviations from the edge.
 *
 * The exponential is Taylor's polynomial of a 32nd of its argument, squared five times (within 2e-6); the error
 * function is 7.1.26 of Abramowitz and Stegun (within 2e-7). Both are free of branches, so that the compiler does
 * several pixels at once. */
static inline Profile profile(double z, double kurtosis) {
    double z2 = z * z;
    double y = lesser(0.5 * z2, 20.0) / 32;
    double bell = 1.0 - y * (1.0 - y / 2 * (1.0 - y / 3 * (1.0 - y / 4)));
    for (int i = 0; i < 5; i++)
        bell *= bell;
    double t = 1.0 / (1.0 + 0.23164188 * fabs(z));
    double tail =
        t * (0.254829592 + t * (-0.284496736 + t * (1.421413741 + t * (-1.453152027 + t * 1.061405429)))) * bell;
    double density = 0.3989422804014327 * bell;
    return (Profile){
        copysign(1.0 - tail, z) - kurtosis * z * (z2 - 3.0) * density,
        (2.0 + kurtosis * (z2 * (z2 - 6.0) + 3.0)) * density,
    };
}

static inline double fourth_power(double x) { return x * x * x * x; }

static inline double from_0_to_1(double weight) { return lesser(greater(weight, 0.0), 1.0); }

/* The columns of the gradients and the residual. */
static void differentiate_by_light(const double *p, Window *window) {
    double a = p[A], b = p[B], a_x = p[A_BY_X], a_y = p[A_BY_Y], b_x = p[B_BY_X], b_y = p[B_BY_Y];
    double(*restrict by)[MOST_PIXELS] = window->column;
    for (int k = 0; k < window->count; k++) {
        double x = window->x[k], y = window->y[k], root = by[A][k], pattern = by[B][k];
        by[A_BY_X][k] = root * x;
        by[A_BY_Y][k] = root * y;
        by[B_BY_X][k] = pattern * x;
        by[B_BY_Y][k] = pattern * y;
        by[RESIDUAL][k] = root * (window->level[k] - a - a_x * x - a_y * y) - pattern * (b + b_x * x + b_y * y);
    }
}

/* Fill the columns; the sum of weights. */
double differentiate(const double *p, const double *bends, const double *size, Window *window) {
    double s = p[BLUR], b = p[B], b_x = p[B_BY_X], b_y = p[B_BY_Y], bend1 = bends[0], bend2 = bends[1];
    double x1 = cos(p[ANGLE_1]), y1 = sin(p[ANGLE_1]), x2 = cos(p[ANGLE_2]), y2 = sin(p[ANGLE_2]);
    double cosine = x1 * x2 + y1 * y2, sine = x1 * y2 - y1 * x2;
    /* the fourth cumulant of a box of width w is -w^4/120; over 12, see profile */
    double box = -1.0 / (1440.0 * fourth_power(greater(s, 0.4)));
    double kurtosis1 = box * (fourth_power(x1) + fourth_power(y1));
    double kurtosis2 = box * (fourth_power(x2) + fourth_power(y2));
    double limit1 = size[0] / RAMP_PX + 0.5, limit2 = size[1] / RAMP_PX + 0.5, clear1 = size[2], clear2 = size[3];
    double(*restrict by)[MOST_PIXELS] = window->column;
    double total = 0.0;
    for (int k = 0; k < window->count; k++) {
        double x = window->x[k], y = window->y[k];
        double across1 = y * x1 - x * y1, across2 = y * x2 - x * y2;
        double along1 = fabs(across2 / sine), along2 = fabs(across1 / sine);
        double weight = from_0_to_1(limit1 - along1 / RAMP_PX) * from_0_to_1(limit2 - along2 / RAMP_PX) *
                        from_0_to_1(greater(clear1 - along1, clear2 - along2));
        total += weight;
        double root = sqrt(weight);
        double turn1 = x * x1 + y * y1, turn2 = x * x2 + y * y2;
        double z1 = (across1 - 0.5 * bend1 * turn1 * turn1) / s, z2 = (across2 - 0.5 * bend2 * turn2 * turn2) / s;
        Profile u = profile(z1, kurtosis1), v = profile(z2, kurtosis2);
        double skew = cosine * u.slope * v.slope, more = 1.0 + 0.5 * cosine * z1 * z2;
        double height = root * (b + b_x * x + b_y * y);
        double slope1 = height / s * (u.slope * v.value + skew * (0.5 * cosine * z2 - z1 * more));
        double slope2 = height / s * (u.value * v.slope + skew * (0.5 * cosine * z1 - z2 * more));
        double shear = height * sine * u.slope * v.slope * (1.0 + cosine * z1 * z2);
        by[AT_X][k] = slope1 * y1 + slope2 * y2;
        by[AT_Y][k] = -slope1 * x1 - slope2 * x2;
        by[ANGLE_1][k] = shear - slope1 * turn1;
        by[ANGLE_2][k] = -shear - slope2 * turn2;
        by[BLUR][k] = -(slope1 * z1 + slope2 * z2);
        by[A][k] = root;
        by[B][k] = root * (u.value * v.value + skew * more);
    }
    differentiate_by_light(p, window);
    return total;
}

/* The columns (PARAMETERS + 1, count) for pixels at x and y from the corner on, which are black: to look at the model. */
EXPORTED void corner_image(const double *p, const double *bends, const double *size, int64_t count, const double *x,
                           const double *y, double *columns) {
    Window window = {.count = count < MOST_PIXELS ? (int)count : MOST_PIXELS};
    memcpy(window.x, x, (size_t)window.count * sizeof *x);
    memcpy(window.y, y, (size_t)window.count * sizeof *y);
    differentiate(p, bends, size, &window);
    for (int k = 0; k <= PARAMETERS; k++)
        memcpy(columns + k * count, window.column[k], (size_t)window.count * sizeof *columns);
}
