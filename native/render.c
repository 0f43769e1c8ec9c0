/* The renderer's loops: how much light each pixel gets from a pattern seen through a smooth map.
 *
 * Nothing here is sampled at points: the part of a small cell that lies on either side of a straight edge is known in
 * closed form, so that edges are where they should be, however they run through the pixels.
 */

#include <math.h>
#include <stdint.h>

#include "exported.h"

/* Grey levels of rectangular cells between edges, and the part of each cell that is on the sheet (0 or 1). */
typedef struct {
    const double *x_edges, *y_edges, *levels, *sheet;
    int64_t columns, rows;
} Pattern;

/* How light from each of samples x samples small cells of a pixel spreads over the size x size pixels around it. */
typedef struct {
    const double *weights;
    int64_t samples, size;
} Response;

/* An image of numbers. */
typedef struct {
    double *values;
    int64_t height, width;
} Plane;

/* A mean grey level in full light, and the part that is covered by the sheet. */
typedef struct {
    double level, covered;
} Mean;

/* A coordinate on the pattern near a pixel, a pixel as unit: value, derivatives by x and y, half the second derivatives
 * by xx and yy, and the mixed one. */
typedef struct {
    double at, x, y, xx, yy, xy;
} Taylor;

/* Along a row of pixels in one interval between nodes: cubics in the fraction of the interval, of the place and of its
 * first and second derivative across rows. */
typedef struct {
    double power[3][4];
} Cubics;

static double square(double x) { return x * x; }

/* Lagrange's cubics through four nodes each way. */
static void row_cubics(const double *places, int64_t node_columns, int64_t row, int64_t step, Cubics *out) {
    int64_t interval = row / step;
    double t = (double)(row - interval * step) / step;
    const double across[3][4] = {
        {-t * (t - 1) * (t - 2) / 6, (t + 1) * (t - 1) * (t - 2) / 2, -(t + 1) * t * (t - 2) / 2, (t + 1) * t * (t - 1) / 6},
        {-(3 * t * t - 6 * t + 2) / 6, (3 * t * t - 4 * t - 1) / 2, -(3 * t * t - 2 * t - 2) / 2, (3 * t * t - 1) / 6},
        {1 - t, 3 * t - 2, 1 - 3 * t, t},
    };
    const double *first = places + (interval - 1) * node_columns;
    double scale = 1.0;
    for (int order = 0; order < 3; order++, scale /= step)
        for (int64_t column = 0; column < node_columns - 3; column++) {
            double n[4];
            for (int k = 0; k < 4; k++) {
                double value = 0.0;
                for (int m = 0; m < 4; m++)
                    value += across[order][m] * first[m * node_columns + column + k];
                n[k] = value * scale;
            }
            double *power = out[column].power[order];
            power[0] = n[1];
            power[1] = n[2] - n[0] / 3 - n[1] / 2 - n[3] / 6;
            power[2] = (n[0] + n[2]) / 2 - n[1];
            power[3] = (n[1] - n[2]) / 2 + (n[3] - n[0]) / 6;
        }
}

/* The coordinate near a pixel, at a fraction of the interval. */
static Taylor taylor(const Cubics *cubics, double t, int64_t step) {
    const double *c = cubics->power[0], *d = cubics->power[1], *e = cubics->power[2];
    return (Taylor){
        .at = c[0] + t * (c[1] + t * (c[2] + t * c[3])),
        .x = (c[1] + t * (2 * c[2] + t * 3 * c[3])) / step,
        .y = d[0] + t * (d[1] + t * (d[2] + t * d[3])),
        .xx = (c[2] + t * 3 * c[3]) / ((double)step * step),
        .yy = 0.5 * (e[0] + t * (e[1] + t * (e[2] + t * e[3]))),
        .xy = (d[1] + t * (2 * d[2] + t * 3 * d[3])) / step,
    };
}

/* How far the coordinate may be from its value anywhere in the pixel. */
static double reach_in_pixel(Taylor u) {
    return 0.5 * (fabs(u.x) + fabs(u.y)) + 0.25 * (fabs(u.xx) + fabs(u.yy) + fabs(u.xy));
}

/* Which cell a place is in, from a guess that is nearly right. */
static int64_t cell_at(const double *edges, double place, int64_t at, int64_t cells) {
    while (at < cells - 1 && place >= edges[at + 1])
        at++;
    while (at > 0 && place < edges[at])
        at--;
    return at;
}

/* The part of a square that lies beyond a straight edge.
 *
 * That is the chance that distance + X + Y > 0 for X and Y evenly spread over their widths. */
static double part_beyond(double distance, double width_x, double width_y) {
    double wide = fmax(width_x, width_y), narrow = fmin(width_x, width_y), d = fabs(distance), part;
    if (d >= 0.5 * (wide + narrow))
        part = 1.0;
    else if (d <= 0.5 * (wide - narrow))
        part = 0.5 + d / wide;
    else
        part = 1.0 - square(0.5 * (wide + narrow) - d) / (2.0 * wide * narrow);
    return distance > 0 ? part : 1.0 - part;
}

/* Over a small cell around (u, v), from the four cells of the pattern about the nearest edges. */
static Mean mixed(const Pattern *pattern, double u, double v, const double u_by[2], const double v_by[2], double size,
                  int64_t i, int64_t j) {
    i = cell_at(pattern->x_edges, u, i, pattern->columns);
    j = cell_at(pattern->y_edges, v, j, pattern->rows);
    int64_t edge_i = u - pattern->x_edges[i] < pattern->x_edges[i + 1] - u ? i : i + 1;
    int64_t edge_j = v - pattern->y_edges[j] < pattern->y_edges[j + 1] - v ? j : j + 1;
    double right = part_beyond(u - pattern->x_edges[edge_i], size * fabs(u_by[0]), size * fabs(u_by[1]));
    double below = part_beyond(v - pattern->y_edges[edge_j], size * fabs(v_by[0]), size * fabs(v_by[1]));
    int64_t left = edge_i > 0 ? edge_i - 1 : 0, top = edge_j > 0 ? edge_j - 1 : 0;
    edge_i = edge_i < pattern->columns ? edge_i : pattern->columns - 1;
    edge_j = edge_j < pattern->rows ? edge_j : pattern->rows - 1;
    const int64_t cells[4] = {
        top * pattern->columns + left,
        top * pattern->columns + edge_i,
        edge_j * pattern->columns + left,
        edge_j * pattern->columns + edge_i,
    };
    const double parts[4] = {(1 - below) * (1 - right), (1 - below) * right, below * (1 - right), below * right};
    Mean mean = {0.0, 0.0};
    for (int k = 0; k < 4; k++) {
        mean.level += parts[k] * pattern->levels[cells[k]];
        mean.covered += parts[k] * pattern->sheet[cells[k]];
    }
    return mean;
}

/* Over a small cell in which there may be a corner of the pattern: cut finer. */
static Mean mixed_finer(const Pattern *pattern, double u, double v, const double u_by[2], const double v_by[2],
                        int64_t i, int64_t j) {
    Mean mean = {0.0, 0.0};
    for (int q = 0; q < 4; q++)
        for (int p = 0; p < 4; p++) {
            double x = (p - 1.5) / 4, y = (q - 1.5) / 4;
            Mean part = mixed(pattern, u + x * u_by[0] + y * u_by[1], v + x * v_by[0] + y * v_by[1], u_by, v_by, 0.25, i, j);
            mean.level += part.level / 16;
            mean.covered += part.covered / 16;
        }
    return mean;
}

static int near_edge(const double *edges, int64_t cell, double place, const double by[2]) {
    return fmin(place - edges[cell], edges[cell + 1] - place) < 0.5 * (fabs(by[0]) + fabs(by[1]));
}

/* The mean light of each of the small cells of a pixel through which edges may run, less a level. */
static void cells_of_pixel(const Pattern *pattern, Taylor x, Taylor y, int64_t i, int64_t j, double bright, double back,
                           double level, int64_t samples, double *cell) {
    const double u_by[2] = {x.x / samples, x.y / samples}, v_by[2] = {y.x / samples, y.y / samples};
    for (int64_t b = 0; b < samples; b++)
        for (int64_t a = 0; a < samples; a++) {
            double dx = (a + 0.5) / samples - 0.5, dy = (b + 0.5) / samples - 0.5;
            double u = x.at + dx * (x.x + dx * x.xx + dy * x.xy) + dy * (x.y + dy * x.yy);
            double v = y.at + dx * (y.x + dx * y.xx + dy * y.xy) + dy * (y.y + dy * y.yy);
            int64_t k = cell_at(pattern->x_edges, u, i, pattern->columns);
            int64_t m = cell_at(pattern->y_edges, v, j, pattern->rows);
            int near_u = near_edge(pattern->x_edges, k, u, u_by), near_v = near_edge(pattern->y_edges, m, v, v_by);
            Mean mean = {pattern->levels[m * pattern->columns + k], pattern->sheet[m * pattern->columns + k]};
            if (near_u && near_v)
                mean = mixed_finer(pattern, u, v, u_by, v_by, k, m);
            else if (near_u || near_v)
                mean = mixed(pattern, u, v, u_by, v_by, 1.0, k, m);
            cell[b * samples + a] = mean.level * bright + (1.0 - mean.covered) * back - level;
        }
}

/* Add what the small cells of a pixel give to the pixels around it. */
static void spread(const double *cell, const Response *response, Plane seen, int64_t row, int64_t column) {
    int64_t size = response->size, reach = size / 2;
    if (row < reach || column < reach || row >= seen.height - reach || column >= seen.width - reach)
        return;
    for (int64_t b = 0; b < response->samples * response->samples; b++) {
        if (cell[b] == 0.0)
            continue;
        const double *weights = response->weights + b * size * size;
        for (int64_t n = 0; n < size; n++) {
            double *line = seen.values + (row - reach + n) * seen.width + column - reach;
            for (int64_t m = 0; m < size; m++)
                line[m] += cell[b] * weights[n * size + m];
        }
    }
}

/* Add what pixels of one level each give to the pixels around them. */
static void convolve(Plane plain, const Response *response, Plane seen) {
    int64_t size = response->size, reach = size / 2;
    for (int64_t row = reach; row < plain.height - reach; row++) {
        double *line = seen.values + row * plain.width;
        for (int64_t n = 0; n < size; n++) {
            const double *source = plain.values + (row + reach - n) * plain.width;
            for (int64_t m = 0; m < size; m++) {
                double weight = 0.0;
                for (int64_t b = 0; b < response->samples * response->samples; b++)
                    weight += response->weights[(b * size + n) * size + m];
                for (int64_t column = reach; column < plain.width - reach; column++)
                    line[column] += weight * source[column + reach - m];
            }
        }
    }
}

/* The image of a pattern before noise.
 *
 * places_x, places_y  (node_rows, node_columns) m: where on the pattern the nodes of a grid of pixels look
 * step                pixels from node to node
 * inset               pixels from the first node to the first pixel wanted
 * x_edges, y_edges    (columns + 1), (rows + 1) m: of the pattern's cells
 * levels, sheet       (rows, columns): each cell's grey level in full light, 0 beside the sheet; 1 on the sheet
 * height, width       of the image wanted, and of the next five
 * light               that falls on the sheet
 * behind              grey level of what is behind it
 * before              grey level that is added whatever is there
 * plain               room to work in
 * seen                in: zeros; out: the image, wrong within half a size of the border, which does not see beyond it
 * weights             (samples, samples, size, size): how light from each small cell of a pixel spreads
 * cell                (samples, samples), and cubics (2, node_columns - 3, 3, 4): room to work in
 */
EXPORTED void light_of(const double *places_x, const double *places_y, int64_t node_columns, int64_t step,
                       int64_t inset, const double *x_edges, const double *y_edges, const double *levels,
                       const double *sheet, int64_t rows, int64_t columns, int64_t height, int64_t width,
                       const double *light, const double *behind, const double *before, double *plain, double *seen,
                       const double *weights, int64_t samples, int64_t size, double *cell, double *cubics) {
    const Pattern pattern = {x_edges, y_edges, levels, sheet, columns, rows};
    const Response response = {weights, samples, size};
    const Plane image = {seen, height, width};
    Cubics *x_cubics = (Cubics *)cubics, *y_cubics = x_cubics + node_columns - 3;
    for (int64_t row = 0; row < height; row++) {
        row_cubics(places_x, node_columns, row + inset, step, x_cubics);
        row_cubics(places_y, node_columns, row + inset, step, y_cubics);
        int64_t i = 0, j = 0;
        for (int64_t column = 0, pixel = row * width; column < width; column++, pixel++) {
            int64_t interval = (column + inset) / step;
            double t = (double)(column + inset - interval * step) / step;
            Taylor x = taylor(x_cubics + interval - 1, t, step), y = taylor(y_cubics + interval - 1, t, step);
            if (isnan(x.at) || isnan(y.at)) {
                plain[pixel] = behind[pixel] + before[pixel];
                continue;
            }
            i = cell_at(x_edges, x.at, i, columns), j = cell_at(y_edges, y.at, j, rows);
            double level = levels[j * columns + i] * light[pixel] + (1.0 - sheet[j * columns + i]) * behind[pixel];
            plain[pixel] = level + before[pixel];
            double half_x = reach_in_pixel(x), half_y = reach_in_pixel(y);
            if (x.at - half_x > x_edges[i] && x.at + half_x < x_edges[i + 1] && y.at - half_y > y_edges[j] &&
                y.at + half_y < y_edges[j + 1])
                continue;
            cells_of_pixel(&pattern, x, y, i, j, light[pixel], behind[pixel], level, samples, cell);
            spread(cell, &response, image, row, column);
        }
    }
    convolve((Plane){plain, height, width}, &response, image);
}
