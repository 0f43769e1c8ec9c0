/* The image of a corner, a + b u v, and its derivatives.
 *
 * u and v are the profiles, from -1 to 1, of two edges that cross in the corner: a step seen through a Gaussian of
 * deviation s. What the product lacks is added to first order: for the pixel's own area, which is no Gaussian, by the
 * Gram-Charlier series with the fourth cumulant of a box; for edges that are not perpendicular, by the tetrachoric
 * series of the bivariate normal distribution. Edges may be bent, by a curvature that is given. a and b have gradients:
 * light that changes across the board scales both, a reflection is added.
 */

#include <math.h>

#include "corner_kernel.h"
#include "exported.h"

typedef struct {
    float value, slope;
} Profile;

/* The image of an edge (-1 to 1) and its derivative, at z deviations from the edge.
 *
 * The exponential is Taylor's polynomial of a 32nd of its argument, squared five times (within 2e-6); the error
 * function is 7.1.26 of Abramowitz and Stegun (within 2e-7). Both are free of branches, so that the compiler does
 * several pixels at once. */
static inline Profile profile(float z, float kurtosis) {
    float z2 = z * z;
    float y = lesser_f(0.5f * z2, 20.0f) / 32;
    float bell = 1 - y * (1 - y / 2 * (1 - y / 3 * (1 - y / 4)));
    for (int i = 0; i < 5; i++)
        bell *= bell;
    float t = 1 / (1 + 0.23164188f * fabsf(z));
    float tail =
        t * (0.254829592f + t * (-0.284496736f + t * (1.421413741f + t * (-1.453152027f + t * 1.061405429f)))) * bell;
    float density = 0.3989422804f * bell;
    return (Profile){
        copysignf(1 - tail, z) - kurtosis * z * (z2 - 3) * density,
        (2 + kurtosis * (z2 * (z2 - 6) + 3)) * density,
    };
}

static inline float fourth_power(float x) { return x * x * x * x; }

static inline float from_0_to_1(float weight) { return lesser_f(greater_f(weight, 0), 1); }

/* The columns of the gradients and the residual. */
static void differentiate_by_light(const double *p, Window *window) {
    float a = (float)p[A], b = (float)p[B];
    float a_x = (float)p[A_BY_X], a_y = (float)p[A_BY_Y], b_x = (float)p[B_BY_X], b_y = (float)p[B_BY_Y];
    float(*restrict by)[MOST_PIXELS] = window->column;
    for (int k = 0; k < window->count; k++) {
        float x = window->x[k], y = window->y[k], root = by[A][k], pattern = by[B][k];
        by[A_BY_X][k] = root * x;
        by[A_BY_Y][k] = root * y;
        by[B_BY_X][k] = pattern * x;
        by[B_BY_Y][k] = pattern * y;
        by[RESIDUAL][k] = root * (window->level[k] - a - a_x * x - a_y * y) - pattern * (b + b_x * x + b_y * y);
    }
}

/* Fill the columns; the sum of weights. */
double differentiate(const double *p, const double *bends, const double *size, Window *window) {
    float b = (float)p[B], b_x = (float)p[B_BY_X], b_y = (float)p[B_BY_Y], sharpness = (float)(1 / p[BLUR]);
    float bend1 = (float)(0.5 * bends[0]), bend2 = (float)(0.5 * bends[1]);
    float x1 = (float)cos(p[ANGLE_1]), y1 = (float)sin(p[ANGLE_1]);
    float x2 = (float)cos(p[ANGLE_2]), y2 = (float)sin(p[ANGLE_2]);
    float cosine = x1 * x2 + y1 * y2, sine = x1 * y2 - y1 * x2, over_sine = 1 / sine;
    /* the fourth cumulant of a box of width w is -w^4/120; over 12, see profile */
    float box = -1 / (1440 * fourth_power(greater_f((float)p[BLUR], 0.4f)));
    float kurtosis1 = box * (fourth_power(x1) + fourth_power(y1));
    float kurtosis2 = box * (fourth_power(x2) + fourth_power(y2));
    float ramp = (float)(1 / RAMP_PX), limit1 = (float)size[0] * ramp + 0.5f, limit2 = (float)size[1] * ramp + 0.5f;
    float clear1 = (float)size[2], clear2 = (float)size[3];
    float(*restrict by)[MOST_PIXELS] = window->column;
    float total = 0;
    for (int k = 0; k < window->count; k++) {
        float x = window->x[k], y = window->y[k];
        float across1 = y * x1 - x * y1, across2 = y * x2 - x * y2;
        float along1 = fabsf(across2 * over_sine), along2 = fabsf(across1 * over_sine);
        float weight = from_0_to_1(limit1 - along1 * ramp) * from_0_to_1(limit2 - along2 * ramp) *
                       from_0_to_1(greater_f(clear1 - along1, clear2 - along2));
        total += weight;
        float root = sqrtf(weight);
        float turn1 = x * x1 + y * y1, turn2 = x * x2 + y * y2;
        float z1 = (across1 - bend1 * turn1 * turn1) * sharpness, z2 = (across2 - bend2 * turn2 * turn2) * sharpness;
        Profile u = profile(z1, kurtosis1), v = profile(z2, kurtosis2);
        float skew = cosine * u.slope * v.slope, more = 1 + 0.5f * cosine * z1 * z2;
        float height = root * (b + b_x * x + b_y * y);
        float slope1 = height * sharpness * (u.slope * v.value + skew * (0.5f * cosine * z2 - z1 * more));
        float slope2 = height * sharpness * (u.value * v.slope + skew * (0.5f * cosine * z1 - z2 * more));
        float shear = height * sine * u.slope * v.slope * (1 + cosine * z1 * z2);
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
    for (int k = 0; k < window.count; k++)
        window.x[k] = (float)x[k], window.y[k] = (float)y[k];
    differentiate(p, bends, size, &window);
    for (int i = 0; i <= PARAMETERS; i++)
        for (int k = 0; k < window.count; k++)
            columns[i * count + k] = window.column[i][k];
}
