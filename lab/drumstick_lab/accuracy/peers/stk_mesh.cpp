/* STK's waveguide mesh at its largest, 11 x 11 junctions, from the distribution's own library. */
#include <stk/Mesh2D.h>
#include <xmmintrin.h>

extern "C" const int junctions = (stk::NXMAX - 1) * (stk::NYMAX - 1);

extern "C" double run(long samples) {
    static stk::Mesh2D mesh(stk::NXMAX, stk::NYMAX);
    const unsigned mode = _mm_getcsr();
    _mm_setcsr(mode | 0x8040); /* denormals are zero: a decayed mesh would be slowed by them */
    mesh.noteOn(0.0, 1.0);
    double sum = 0.0;
    for (long i = 0; i < samples; i++) sum += mesh.tick();
    _mm_setcsr(mode);
    return sum;
}

/* A blow near a corner, which is no mode's node, and what the mesh's own pickup hears of it. */
extern "C" void response(long samples, double *out) {
    stk::Mesh2D mesh(stk::NXMAX, stk::NYMAX);
    mesh.setInputPosition(0.1, 0.2);
    mesh.noteOn(0.0, 1.0);
    for (long i = 0; i < samples; i++) out[i] = mesh.tick();
}
