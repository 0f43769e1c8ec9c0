/* The fit of the image of a checkerboard's corner.
 *
 * Around a corner the image is taken as a + b u v, see corner_image.c. Whatever is wrong with this model is alike on
 * opposite sides of the corner (another psf, neighbouring squares, a tone curve) and so does not move it, as long as
 * the window is symmetric about the corner: therefore the window follows the corner in every step, and ends in a soft
 * ramp instead of at whole pixels, see corner_window.c. corner_algebra.c has the algebra of a step, corner_fit.c the
 * steps, corner_examination.c what a fit tells beside the place.
 */
#ifndef CORNER_KERNEL_H
#define CORNER_KERNEL_H

#include <stdint.h>

/* The order of parameters: place of the corner, px; angles of both edges, rad; deviation of the blur, px; a and b, grey
 * levels; their gradients in x and y, grey levels per px. */
enum { AT_X, AT_Y, ANGLE_1, ANGLE_2, BLUR, A, B, A_BY_X, A_BY_Y, B_BY_X, B_BY_Y, PARAMETERS };

enum { CONVERGED, OUTSIDE, FAILED };

/* What is found: status; variance of residuals without what is alike on opposite sides of the corner; variance without
 * what is alike in neighbouring pixels; the inverse normal matrix of x and y (xx, xy, yy); how x, then y, responds to
 * each edge's bend; of each quarter of the window the mean residual over the amplitude, the share of saturated pixels,
 * and the weight; variance of residuals. */
enum {
    STATUS,
    UNLIKE_OPPOSITES,
    UNLIKE_NEIGHBOURS,
    INVERSE,
    RESPONSE = INVERSE + 3,
    MISFIT = RESPONSE + 4,
    SATURATION = MISFIT + 4,
    WEIGHT = SATURATION + 4,
    VARIANCE = WEIGHT + 4,
    DIAGNOSTICS
};

/* The largest window, a parallelogram with sides of 2 * 14 + 1.5 px, holds fewer pixels than this. */
enum { MOST_PIXELS = 1088 };

#define RAMP_PX 1.5 /* over which a pixel's weight falls to nothing at the border of the window */
#define SHARPEST_PX 0.3 /* that a pixel can see, being 0.29 wide itself; what was sharpened afterwards seems sharper */

/* Unlike fmin and fmax they need not look for what is not a number, so that loops with them work on several at once. */
static inline double lesser(double a, double b) { return a < b ? a : b; }
static inline double greater(double a, double b) { return a > b ? a : b; }
static inline float lesser_f(float a, float b) { return a < b ? a : b; }
static inline float greater_f(float a, float b) { return a > b ? a : b; }

/* Grey levels of 8 or 16 bits, row after row; one of the two is NULL. */
typedef struct {
    const uint8_t *bytes;
    const uint16_t *words;
    int64_t height, width;
} Image;

/* The pixels of a window: x and y from the corner on, grey level, and, each times the root of the pixel's weight, the
 * derivatives by each parameter and the residual. The derivative by a is the root of the weight. Single precision, with
 * which twice as many pixels are done at once, moves a corner by some 1e-8 px. */
typedef struct {
    int count;
    float x[MOST_PIXELS], y[MOST_PIXELS], level[MOST_PIXELS];
    float column[PARAMETERS + 1][MOST_PIXELS];
} Window;

enum { RESIDUAL = PARAMETERS, ROOT = A };

typedef double Normal[PARAMETERS + 1][PARAMETERS + 1];
typedef double Factor[PARAMETERS][PARAMETERS];

int gather(const Image *image, const double *p, const double *size, Window *window);
double differentiate(const double *p, const double *bends, const double *size, Window *window);

void accumulate(const Window *window, Normal normal);
void expect(const double *p, double variance, Normal normal);
int factorise(Normal normal, Factor factor);
void solve(Factor factor, double *vector);
void take_from_residuals(Window *window, const double *step);

void examine_place(const double *p, const Window *window, Factor factor, double *found);
void examine_quarters(const double *p, const Window *window, double white, double *found);
void examine_opposites(const double *p, const Window *window, double *found);

#endif
