/* The algebra of a step: the normal matrix, what is known before looking, Cholesky's factor. */

#include <math.h>
#include <string.h>

#include "corner_kernel.h"

/* Of b, per px: a lamp's reflection is steep, light is not. */
#define USUAL_GRADIENT_OF_A 0.02
#define USUAL_GRADIENT_OF_B 0.002

/* The normal matrix of the columns, its last row that of the residual; lower triangle.
 *
 * Three rows by three columns at once, each number that is read is used three times; and some pixels after the others,
 * which stay in the nearest memory and whose sums, in single precision, stay short. */
void accumulate(const Window *window, Normal normal) {
    enum { BLOCK = 3, PIXELS = 256 };
    memset(normal, 0, sizeof(Normal));
    for (int start = 0; start < window->count; start += PIXELS) {
        int end = start + PIXELS < window->count ? start + PIXELS : window->count;
        for (int i = 0; i <= PARAMETERS; i += BLOCK)
            for (int j = 0; j <= i; j += BLOCK) {
                const float(*a)[MOST_PIXELS] = window->column + i, (*b)[MOST_PIXELS] = window->column + j;
                float s00 = 0, s01 = 0, s02 = 0, s10 = 0, s11 = 0, s12 = 0, s20 = 0, s21 = 0, s22 = 0;
                for (int k = start; k < end; k++) {
                    float a0 = a[0][k], a1 = a[1][k], a2 = a[2][k], b0 = b[0][k], b1 = b[1][k], b2 = b[2][k];
                    s00 += a0 * b0, s01 += a0 * b1, s02 += a0 * b2;
                    s10 += a1 * b0, s11 += a1 * b1, s12 += a1 * b2;
                    s20 += a2 * b0, s21 += a2 * b1, s22 += a2 * b2;
                }
                normal[i][j] += s00, normal[i][j + 1] += s01, normal[i][j + 2] += s02;
                normal[i + 1][j] += s10, normal[i + 1][j + 1] += s11, normal[i + 1][j + 2] += s12;
                normal[i + 2][j] += s20, normal[i + 2][j + 1] += s21, normal[i + 2][j + 2] += s22;
            }
    }
}

/* Add what is known before looking: that gradients are small, relative to the amplitude, and what can be sharp.
 *
 * In small windows and much blur gradients can hardly be told from a shift of the corner. */
void expect(const double *p, double variance, Normal normal) {
    for (int k = A_BY_X; k < PARAMETERS; k++) {
        double usual = (k < B_BY_X ? USUAL_GRADIENT_OF_A : USUAL_GRADIENT_OF_B) * p[B];
        double weight = variance / (usual * usual + 1e-9);
        normal[k][k] += weight;
        normal[PARAMETERS][k] -= weight * p[k];
    }
    if (p[BLUR] <= SHARPEST_PX && normal[PARAMETERS][BLUR] < 0.0)
        normal[BLUR][BLUR] *= 1e6; /* it will not get sharper, and the others' step must not count on it */
}

/* Cholesky's factor of the normal matrix; 0 if there is none. */
int factorise(Normal normal, Factor factor) {
    for (int i = 0; i < PARAMETERS; i++)
        for (int j = 0; j <= i; j++) {
            double value = normal[i][j];
            for (int k = 0; k < j; k++)
                value -= factor[i][k] * factor[j][k];
            if (i > j)
                factor[i][j] = value / factor[j][j];
            else if (value > 1e-12 * normal[i][i])
                factor[i][i] = sqrt(value);
            else
                return 0;
        }
    return 1;
}

/* Replace a right-hand side by its solution. */
void solve(Factor factor, double *vector) {
    for (int i = 0; i < PARAMETERS; i++) {
        for (int k = 0; k < i; k++)
            vector[i] -= factor[i][k] * vector[k];
        vector[i] /= factor[i][i];
    }
    for (int i = PARAMETERS - 1; i >= 0; i--) {
        for (int k = i + 1; k < PARAMETERS; k++)
            vector[i] -= factor[k][i] * vector[k];
        vector[i] /= factor[i][i];
    }
}

/* What the residuals are after a short step. */
void take_from_residuals(Window *window, const double *step) {
    float *restrict residual = window->column[RESIDUAL];
    for (int i = 0; i < PARAMETERS; i++) {
        float change = (float)step[i];
        for (int k = 0; k < window->count; k++)
            residual[k] -= change * window->column[i][k];
    }
}
