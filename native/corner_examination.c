/* What a fit tells beside the place: how sure it is, and what disturbs it. */

#include <math.h>

#include "corner_kernel.h"

/* How hard each edge's bend pulls at each parameter: its derivative's products with the others. */
static void pull(const double *p, const Window *window, double pulls[PARAMETERS][2]) {
    float x1 = (float)cos(p[ANGLE_1]), y1 = (float)sin(p[ANGLE_1]);
    float x2 = (float)cos(p[ANGLE_2]), y2 = (float)sin(p[ANGLE_2]);
    float by_bend1[MOST_PIXELS], by_bend2[MOST_PIXELS];
    for (int k = 0; k < window->count; k++) {
        float x = window->x[k], y = window->y[k];
        by_bend1[k] = 0.5f * window->column[ANGLE_1][k] * (x * x1 + y * y1);
        by_bend2[k] = 0.5f * window->column[ANGLE_2][k] * (x * x2 + y * y2);
    }
    for (int i = 0; i < PARAMETERS; i++) {
        float pull1 = 0, pull2 = 0;
        for (int k = 0; k < window->count; k++) {
            pull1 += window->column[i][k] * by_bend1[k];
            pull2 += window->column[i][k] * by_bend2[k];
        }
        pulls[i][0] = pull1, pulls[i][1] = pull2;
    }
}

/* The inverse normal matrix of x and y, and their response to bends: what a bend adds to the image, they take back. */
void examine_place(const double *p, const Window *window, Factor factor, double *found) {
    double pulls[PARAMETERS][2];
    pull(p, window, pulls);
    for (int coordinate = 0; coordinate < 2; coordinate++) {
        double row[PARAMETERS] = {0.0};
        row[coordinate] = 1.0;
        solve(factor, row);
        found[INVERSE + coordinate] = row[AT_X], found[INVERSE + coordinate + 1] = row[AT_Y];
        for (int edge = 0; edge < 2; edge++)
            for (int k = 0; k < PARAMETERS; k++)
                found[RESPONSE + 2 * coordinate + edge] -= row[k] * pulls[k][edge];
    }
}

/* Each quarter's mean residual, over the amplitude, and its share of saturated pixels. */
void examine_quarters(const double *p, const Window *window, double white, double *found) {
    float x1 = (float)cos(p[ANGLE_1]), y1 = (float)sin(p[ANGLE_1]);
    float x2 = (float)cos(p[ANGLE_2]), y2 = (float)sin(p[ANGLE_2]), saturated = (float)white, total = 0;
    float misfit[4] = {0}, saturation[4] = {0}, weight[4] = {0};
    for (int k = 0; k < window->count; k++) {
        float x = window->x[k], y = window->y[k], root = window->column[ROOT][k], residual = window->column[RESIDUAL][k];
        int side1 = y * x1 > x * y1, side2 = y * x2 > x * y2, bright = window->level[k] >= saturated;
        total += residual * residual;
        for (int quarter = 0; quarter < 4; quarter++) {
            float part = side1 == quarter / 2 && side2 == quarter % 2 ? root : 0;
            misfit[quarter] += part * residual;
            saturation[quarter] += bright ? part * part : 0;
            weight[quarter] += part * part;
        }
    }
    for (int quarter = 0; quarter < 4; quarter++) {
        double pixels = greater(weight[quarter], 1.0);
        found[MISFIT + quarter] = misfit[quarter] / (pixels * fabs(p[B]));
        found[SATURATION + quarter] = saturation[quarter] / pixels;
        found[WEIGHT + quarter] = weight[quarter];
    }
    found[VARIANCE] = total / greater(weight[0] + weight[1] + weight[2] + weight[3] - PARAMETERS, 1.0);
}

/* The residuals, laid out as they are in the image, the corner in the middle; what is not a number has no residual. */
enum { SIDE = 72 }; /* windows reach 29.5 px from the corner, and their opposite a pixel farther */
typedef struct {
    float residual[SIDE][SIDE];
    int64_t first_row, last_row, first_column, last_column;
} Picture;

/* Where a pixel so far from the corner is, from the picture's edge on. */
static int64_t place(float distance, double corner, int64_t edge) {
    return (int64_t)floor(distance + corner + 0.5) - edge;
}

static void lay_out(const double *p, const Window *window, Picture *picture) {
    int64_t left = (int64_t)floor(p[AT_X]) - SIDE / 2, top = (int64_t)floor(p[AT_Y]) - SIDE / 2;
    for (int row = 0; row < SIDE; row++)
        for (int column = 0; column < SIDE; column++)
            picture->residual[row][column] = NAN;
    picture->first_row = picture->first_column = SIDE;
    picture->last_row = picture->last_column = 0;
    for (int start = 0, end = 0; start < window->count; start = end) {
        while (end < window->count && window->y[end] == window->y[start])
            end++;
        int64_t row = place(window->y[start], p[AT_Y], top), column = place(window->x[start], p[AT_X], left);
        const float *root = window->column[ROOT] + start, *residual = window->column[RESIDUAL] + start;
        float *here = picture->residual[row] + column;
        for (int k = 0; k < end - start; k++)
            here[k] = root[k] > 0.999f ? residual[k] : NAN;
        if (picture->first_row == SIDE)
            picture->first_row = row; /* rows come from the top down */
        picture->last_row = row;
        if (column < picture->first_column)
            picture->first_column = column;
        if (column + end - start - 1 > picture->last_column)
            picture->last_column = column + end - start - 1;
    }
}

/* How much residuals differ from those on the opposite side of the corner, and from those beside them.
 *
 * The opposite of a pixel lies between four; where between them is the same for all pixels. */
void examine_opposites(const double *p, const Window *window, double *found) {
    Picture picture;
    lay_out(p, window, &picture);
    float right = (float)(2 * p[AT_X] - floor(2 * p[AT_X])), down = (float)(2 * p[AT_Y] - floor(2 * p[AT_Y]));
    float left = 1 - right, up = 1 - down;
    int64_t opposite_row = (int64_t)(floor(2 * p[AT_Y]) - 2 * (floor(p[AT_Y]) - SIDE / 2));
    int64_t opposite_column = (int64_t)(floor(2 * p[AT_X]) - 2 * (floor(p[AT_X]) - SIDE / 2));
    float unlike = 0, opposites = 0, beside = 0, neighbours = 0;
    for (int64_t row = picture.first_row; row <= picture.last_row; row++) {
        const float *here = picture.residual[row];
        const float *above = picture.residual[opposite_row - row], *below = above + SIDE;
        for (int64_t column = picture.first_column; column <= picture.last_column; column++) {
            int64_t before = opposite_column - column;
            float upper = left * above[before] + right * above[before + 1];
            float lower = left * below[before] + right * below[before + 1];
            float difference = here[column] - up * upper - down * lower;
            float step = here[column] - here[column + 1];
            unlike += isnan(difference) ? 0 : difference * difference;
            opposites += isnan(difference) ? 0 : 1;
            beside += isnan(step) ? 0 : step * step;
            neighbours += isnan(step) ? 0 : 1;
        }
    }
    double gain = 1.0 + (left * left + right * right) * (up * up + down * down);
    /* four parameters took their share of what is not alike on opposite sides: half of all freedoms */
    found[UNLIKE_OPPOSITES] = opposites > 40 ? unlike / gain / (opposites - 8) : found[VARIANCE];
    found[UNLIKE_NEIGHBOURS] = beside / 2 / greater(neighbours, 1.0);
}
