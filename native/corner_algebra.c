/* The algebra of a step: the normal matrix, what is known before looking, Cholesky's factor. */

#include <math.h>

#include "corner_kernel.h"

/* Of b, per px: a lamp's reflection is steep, light is not. */
#define USUAL_GRADIENT_OF_A 0.02
#define USUAL_GRADIENT_OF_B 0.002

/* The normal matrix of the columns, its last row that of the residual; lower triangle.
 *
 * Two rows by two columns at once: each number that is read is used twice. */
void accumulate(const Window *window, Normal normal) {
    for (int i = 0; i <= PARAMETERS; i += 2)
        for (int j = 0; j <= i; j += 2) {
            const double *a = window->column[i], *b = window->column[i + 1];
            const double *c = window->column[j], *d = window->column[j + 1];
            double ac = 0.0, ad = 0.0, bc = 0.0, bd = 0.0;
            for (int k = 0; k < window->count; k++) {
                ac += a[k] * c[k];
                ad += a[k] * d[k];
                bc += b[k] * c[k];
                bd += b[k] * d[k];
            }
            normal[i][j] = ac, normal[i][j + 1] = ad, normal[i + 1][j] = bc, normal[i + 1][j + 1] = bd;
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
    double *restrict residual = window->column[RESIDUAL];
    for (int i = 0; i < PARAMETERS; i++)
        for (int k = 0; k < window->count; k++)
            residual[k] -= step[i] * window->column[i][k];
}
