/* What a fit tells beside the place: how sure it is, and what disturbs it. */

#include <math.h>

#include "corner_kernel.h"

/* How hard each edge's bend pulls at each parameter: its derivative's products with the others. */
static void pull(const double *p, const Window *window, double pulls[PARAMETERS][2]) {
    double x1 = cos(p[ANGLE_1]), y1 = sin(p[ANGLE_1]), x2 = cos(p[ANGLE_2]), y2 = sin(p[ANGLE_2]);
    const double *by_angle1 = window->column[ANGLE_1], *by_angle2 = window->column[ANGLE_2];
    for (int i = 0; i < PARAMETERS; i++) {
        double pull1 = 0.0, pull2 = 0.0;
        for (int k = 0; k < window->count; k++) {
            double x = window->x[k], y = window->y[k], by = window->column[i][k];
            pull1 += by * by_angle1[k] * (x * x1 + y * y1);
            pull2 += by * by_angle2[k] * (x * x2 + y * y2);
        }
        pulls[i][0] = 0.5 * pull1, pulls[i][1] = 0.5 * pull2;
    }
}

/* The inverse normal matrix of x and y, and their response to bends. */
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
                found[RESPONSE + 2 * coordinate + edge] += row[k] * pulls[k][edge];
    }
}

/* Each quarter's mean residual, over the amplitude, and its share of saturated pixels. */
void examine_quarters(const double *p, const Window *window, double white, double *found) {
    double x1 = cos(p[ANGLE_1]), y1 = sin(p[ANGLE_1]), x2 = cos(p[ANGLE_2]), y2 = sin(p[ANGLE_2]);
    double total = 0.0, weights = 0.0;
    for (int k = 0; k < window->count; k++) {
        double x = window->x[k], y = window->y[k];
        double root = window->column[ROOT][k], residual = window->column[RESIDUAL][k];
        int quarter = 2 * (y * x1 > x * y1) + (y * x2 > x * y2);
        total += residual * residual;
        weights += root * root;
        found[MISFIT + quarter] += root * residual;
        found[SATURATION + quarter] += window->level[k] >= white ? root * root : 0.0;
        found[WEIGHT + quarter] += root * root;
    }
    for (int quarter = 0; quarter < 4; quarter++) {
        found[MISFIT + quarter] /= greater(found[WEIGHT + quarter], 1.0) * greater(fabs(p[B]), 1e-9);
        found[SATURATION + quarter] /= greater(found[WEIGHT + quarter], 1.0);
    }
    found[VARIANCE] = total / greater(weights - PARAMETERS, 1.0);
}

/* The residuals, laid out as they are in the image, the corner in the middle; what is not a number has no residual. */
enum { SIDE = 72 }; /* windows reach 29.5 px from the corner, and their opposite a pixel farther */
typedef struct {
    double residual[SIDE][SIDE];
    int64_t first_row, last_row, first_column, last_column;
} Picture;

static void lay_out(const double *p, const Window *window, Picture *picture) {
    int64_t left = (int64_t)floor(p[AT_X]) - SIDE / 2, top = (int64_t)floor(p[AT_Y]) - SIDE / 2;
    for (int row = 0; row < SIDE; row++)
        for (int column = 0; column < SIDE; column++)
            picture->residual[row][column] = NAN;
    picture->first_row = picture->first_column = SIDE;
    picture->last_row = picture->last_column = 0;
    for (int k = 0; k < window->count; k++) {
        int64_t row = (int64_t)floor(window->y[k] + p[AT_Y] + 0.5) - top;
        int64_t column = (int64_t)floor(window->x[k] + p[AT_X] + 0.5) - left;
        if (row < picture->first_row)
            picture->first_row = row;
        if (row > picture->last_row)
            picture->last_row = row;
        if (column < picture->first_column)
            picture->first_column = column;
        if (column > picture->last_column)
            picture->last_column = column;
        if (window->column[ROOT][k] > 0.999)
            picture->residual[row][column] = window->column[RESIDUAL][k];
    }
}

/* How much residuals differ from those on the opposite side of the corner, and from those beside them.
 *
 * The opposite of a pixel lies between four; where between them is the same for all pixels. */
void examine_opposites(const double *p, const Window *window, double *found) {
    Picture picture;
    lay_out(p, window, &picture);
    double right = 2 * p[AT_X] - floor(2 * p[AT_X]), down = 2 * p[AT_Y] - floor(2 * p[AT_Y]);
    int64_t opposite_row = (int64_t)(floor(2 * p[AT_Y]) - 2 * (floor(p[AT_Y]) - SIDE / 2));
    int64_t opposite_column = (int64_t)(floor(2 * p[AT_X]) - 2 * (floor(p[AT_X]) - SIDE / 2));
    double unlike = 0.0, opposites = 0.0, beside = 0.0, neighbours = 0.0;
    for (int64_t row = picture.first_row; row <= picture.last_row; row++) {
        const double *here = picture.residual[row];
        const double *above = picture.residual[opposite_row - row], *below = above + SIDE;
        for (int64_t column = picture.first_column; column <= picture.last_column; column++) {
            int64_t before = opposite_column - column;
            double upper = (1 - right) * above[before] + right * above[before + 1];
            double lower = (1 - right) * below[before] + right * below[before + 1];
            double difference = here[column] - (1 - down) * upper - down * lower;
            double step = here[column] - here[column + 1];
            unlike += isnan(difference) ? 0.0 : difference * difference;
            opposites += isnan(difference) ? 0.0 : 1.0;
            beside += isnan(step) ? 0.0 : step * step;
            neighbours += isnan(step) ? 0.0 : 1.0;
        }
    }
    double gain = 1.0 + ((1 - right) * (1 - right) + right * right) * ((1 - down) * (1 - down) + down * down);
    /* four parameters took their share of what is not alike on opposite sides: half of all freedoms */
    found[UNLIKE_OPPOSITES] = opposites > 40 ? unlike / gain / (opposites - 8) : found[VARIANCE];
    found[UNLIKE_NEIGHBOURS] = beside / 2 / greater(neighbours, 1.0);
}
