/* The triangular mesh's step as one writes it in C: u+ = w sum6(u) + u_gain u - u_old_gain u-, row by row. */

static void step(const float *restrict now, float *restrict then, const float *restrict weights, const int *spans,
                 int rows, int stride, int centre_row, float u_gain, float u_old_gain) {
    for (int row = 1; row < rows - 1; row++) {
        const int start = row * stride + spans[2 * row];
        const int n = spans[2 * row + 1];
        const int shift = (row - centre_row) & 1;
        const float *along = now + start;
        const float *above = now + start - stride - 1 + shift;
        const float *below = now + start + stride - 1 + shift;
        const float *w = weights + start;
        float *u = then + start;
        for (int i = 0; i < n; i++) {
            const float ring = (along[i - 1] + along[i + 1]) + (above[i] + above[i + 1]) + (below[i] + below[i + 1]);
            u[i] = w[i] * ring + u_gain * along[i] - u_old_gain * u[i];
        }
    }
}

void run(float *one, float *other, const float *weights, const int *spans, int rows, int stride, int centre_row,
         float u_gain, float u_old_gain, int steps) {
    for (int k = 0; k < steps; k++) {
        if (k & 1)
            step(other, one, weights, spans, rows, stride, centre_row, u_gain, u_old_gain);
        else
            step(one, other, weights, spans, rows, stride, centre_row, u_gain, u_old_gain);
    }
}
