/* The pixels around a corner that a fit looks at: a parallelogram along its edges. */

#include <math.h>

#include "corner_kernel.h"

typedef struct {
    double low, high;
} Interval;

/* The part of an interval of x in which |slope x - offset| <= half. */
static Interval overlap(double offset, double slope, double half, Interval within) {
    if (fabs(slope) < 1e-9)
        return fabs(offset) <= half ? within : (Interval){1.0, 0.0};
    double middle = offset / slope, reach = half / fabs(slope);
    return (Interval){greater(within.low, middle - reach), lesser(within.high, middle + reach)};
}

/* Copy the window's pixels; 0 if some are outside of the image, or they are more than there is room for. */
int gather(const Image *image, const double *p, const double *size, Window *window) {
    double x1 = cos(p[ANGLE_1]), y1 = sin(p[ANGLE_1]), x2 = cos(p[ANGLE_2]), y2 = sin(p[ANGLE_2]);
    double half1 = size[0] + 0.5 * RAMP_PX, half2 = size[1] + 0.5 * RAMP_PX, sine = fabs(x1 * y2 - y1 * x2);
    double reach_x = half1 * fabs(x1) + half2 * fabs(x2), reach_y = half1 * fabs(y1) + half2 * fabs(y2);
    /* not the opposite comparisons: what is not a number must not pass */
    if (!(reach_x <= p[AT_X] && p[AT_X] <= image->width - 1 - reach_x))
        return 0;
    if (!(reach_y <= p[AT_Y] && p[AT_Y] <= image->height - 1 - reach_y))
        return 0;
    int n = 0;
    int64_t last_row = (int64_t)floor(p[AT_Y] + reach_y);
    for (int64_t row = (int64_t)ceil(p[AT_Y] - reach_y); row <= last_row; row++) {
        double y = row - p[AT_Y];
        Interval part = overlap(x2 * y, y2, half1 * sine, (Interval){-reach_x, reach_x});
        part = overlap(x1 * y, y1, half2 * sine, part);
        int64_t first = (int64_t)ceil(part.low + p[AT_X]), last = (int64_t)floor(part.high + p[AT_X]);
        int count = last < first ? 0 : (int)(last - first + 1);
        if (n + count > MOST_PIXELS)
            return 0;
        float from = (float)(first - p[AT_X]);
        for (int k = 0; k < count; k++) {
            window->x[n + k] = from + (float)k;
            window->y[n + k] = (float)y;
        }
        int64_t start = row * image->width + first;
        for (int k = 0; k < count; k++)
            window->level[n + k] = image->bytes ? image->bytes[start + k] : image->words[start + k];
        n += count;
    }
    window->count = n;
    return 1;
}
