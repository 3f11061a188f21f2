/* The plain five-state filter by hand, as one would write it for a microcontroller: the yardstick of the benchmarks.
 *
 * Same arithmetic as src/steerway/estimation (exact turn, spectral densities, upper triangle, Joseph's form, start by
 * a linear filter, gate), in a fixed plane, without receiver errors, aids, position resets and long gaps. What depends
 * on the time step alone is computed when the step changes, as there.
 */

#include <math.h>
#include <stddef.h>

/* SPEED_NOISE and its like, the places in `model`, are defined where this is compiled. */
enum { EMPTY, FIRST, STARTING, LOW_SPEED, UNDERWAY };
enum { SAID = 10 };

typedef struct {
    double dt, speed_left, speed_integral, rate_left, turn, lean;
    double along, along_u, q_ww, q_xw, q_xx, q_yw, q_yx, q_yy;
} Step;

typedef struct {
    int mode;
    double n, e, u, x, w; /* in low-speed mode u, x are the velocity north and east */
    double nn, ne, nu, nx, nw, ee, eu, ex, ew, uu, ux, uw, xx, xw, ww;
} Filter;

static void decay(double rate, double dt, double *left, double *integral)
{
    if (rate == 0.0) {
        *left = 1.0;
        *integral = dt;
        return;
    }
    double lost = -expm1(-rate * dt);
    *left = 1.0 - lost;
    *integral = lost / rate;
}

static void turn_response(double rate, double dt, double *left, double *turn, double *area)
{
    double a = rate * dt;
    if (a < 0.02) {
        double f = 1.0 / 2 - a * (1.0 / 6 - a * (1.0 / 24 - a * (1.0 / 120 - a * (1.0 / 720)))), g = 1.0 - a * f;
        *left = 1.0 - a * g;
        *turn = dt * g;
        *area = dt * dt * f;
        return;
    }
    double lost = -expm1(-a);
    *left = 1.0 - lost;
    *turn = lost / rate;
    *area = (dt - *turn) / rate;
}

static Step step_of(double dt, const double *model)
{
    Step s = {.dt = dt};
    double area, node = sqrt(0.15);
    decay(model[SPEED_DECAY], dt, &s.speed_left, &s.speed_integral);
    turn_response(model[RATE_DECAY], dt, &s.rate_left, &s.turn, &area);
    s.lean = area / dt;
    s.along = model[SPEED_NOISE] * dt * dt * dt / 3.0;
    s.along_u = 0.5 * model[SPEED_NOISE] * dt * dt;
    for (int k = -1; k < 2; k++) {
        double w, x, y, weight = model[RATE_NOISE] * dt * (k == 0 ? 4.0 / 9 : 5.0 / 18);
        turn_response(model[RATE_DECAY], dt * (0.5 + k * node), &w, &x, &y);
        s.q_ww += weight * w * w;
        s.q_xw += weight * x * w;
        s.q_xx += weight * x * x;
        s.q_yw += weight * y * w;
        s.q_yx += weight * y * x;
        s.q_yy += weight * y * y;
    }
    return s;
}

static void predict(Filter *f, const Step *k, double speed_noise)
{
    double u = f->u, mean = f->x + k->lean * f->w, c = cos(mean), s = sin(mean);
    double angle = 0.5 * k->turn * f->w, ratio, slope;
    if (fabs(angle) < 0.05) {
        double b = angle * angle;
        ratio = 1.0 - b * (1.0 / 6 - b * (1.0 / 120 - b * (1.0 / 5040)));
        slope = -angle * (1.0 / 3 - b * (1.0 / 30 - b * (1.0 / 840 - b * (1.0 / 45360))));
    } else {
        ratio = sin(angle) / angle;
        slope = (cos(angle) - ratio) / angle;
    }
    double per_speed = k->speed_integral * ratio, length = u * per_speed;
    double along_w = 0.5 * k->turn * slope * u * k->speed_integral, across_w = k->lean * length;
    double dn = length * c, de = length * s, n_u = per_speed * c, e_u = per_speed * s;
    double n_w = along_w * c - across_w * s, e_w = along_w * s + across_w * c;
    double a = k->speed_left, b = k->rate_left, t = k->turn;

    double n0 = f->nn + n_u * f->nu - de * f->nx + n_w * f->nw, n1 = f->ne + n_u * f->eu - de * f->ex + n_w * f->ew;
    double n2 = f->nu + n_u * f->uu - de * f->ux + n_w * f->uw, n3 = f->nx + n_u * f->ux - de * f->xx + n_w * f->xw;
    double n4 = f->nw + n_u * f->uw - de * f->xw + n_w * f->ww;
    double e1 = f->ee + e_u * f->eu + dn * f->ex + e_w * f->ew, e2 = f->eu + e_u * f->uu + dn * f->ux + e_w * f->uw;
    double e3 = f->ex + e_u * f->ux + dn * f->xx + e_w * f->xw, e4 = f->ew + e_u * f->uw + dn * f->xw + e_w * f->ww;
    double x3 = f->xx + t * f->xw, x4 = f->xw + t * f->ww;
    double across = u * u * k->q_yy, across_x = u * k->q_yx, across_r = u * k->q_yw;

    f->n += dn;
    f->e += de;
    f->u = u * a;
    f->x += t * f->w;
    f->w *= b;
    f->nn = n0 + n_u * n2 - de * n3 + n_w * n4 + c * c * k->along + s * s * across;
    f->ne = n1 + e_u * n2 + dn * n3 + e_w * n4 + c * s * (k->along - across);
    f->ee = e1 + e_u * e2 + dn * e3 + e_w * e4 + s * s * k->along + c * c * across;
    f->nu = n2 * a + c * k->along_u;
    f->eu = e2 * a + s * k->along_u;
    f->nx = n3 + t * n4 - s * across_x;
    f->ex = e3 + t * e4 + c * across_x;
    f->nw = n4 * b - s * across_r;
    f->ew = e4 * b + c * across_r;
    f->ux = (f->ux + t * f->uw) * a;
    f->uu = f->uu * a * a + speed_noise * k->dt;
    f->uw *= a * b;
    f->xx = x3 + t * x4 + k->q_xx;
    f->xw = x4 * b + k->q_xw;
    f->ww = f->ww * b * b + k->q_ww;
}

static void predict_adrift(Filter *f, const Step *k, const double *model)
{
    double density = model[SPEED_NOISE] + model[STEERAGEWAY] * model[STEERAGEWAY] / 10.0, dt = k->dt;
    double a = k->speed_left, t = k->speed_integral, added = density * dt;
    f->n += t * f->u;
    f->e += t * f->x;
    f->u *= a;
    f->x *= a;
    f->nn += t * (2 * f->nu + t * f->uu) + added * dt * dt / 3.0;
    f->ee += t * (2 * f->ex + t * f->xx) + added * dt * dt / 3.0;
    f->ne += t * (f->nx + f->eu + t * f->ux);
    f->nu = a * (f->nu + t * f->uu) + added * dt / 2.0;
    f->ex = a * (f->ex + t * f->xx) + added * dt / 2.0;
    f->nx = a * (f->nx + t * f->ux);
    f->eu = a * (f->eu + t * f->ux);
    f->uu = a * a * f->uu + added;
    f->xx = a * a * f->xx + added;
    f->ux *= a * a;
}

static void start(Filter *f, double north, double east, const double *model)
{
    *f = (Filter){.mode = FIRST, .n = north, .e = east, .uu = model[START_SPEED_VARIANCE], .xx = model[START_SPEED_VARIANCE],
                  .ww = model[START_RATE_VARIANCE], .nn = model[POSITION_VARIANCE], .ee = model[POSITION_VARIANCE]};
}

static double correct(Filter *f, double north, double east, const double *model)
{
    double r = model[POSITION_VARIANCE], v = north - f->n, z = east - f->e;
    double a = f->nn + r, b = f->ne, d = f->ee + r, determinant = a * d - b * b;
    double nis = (v * v * d - 2 * v * z * b + z * z * a) / determinant;
    if (!(nis <= model[GATE]))
        return nis;
    double i_nn = d / determinant, i_ne = -b / determinant, i_ee = a / determinant;
    double p[5] = {f->nn, f->ne, f->nu, f->nx, f->nw}, q[5] = {f->ne, f->ee, f->eu, f->ex, f->ew}, k[5], g[5];
    double *x[5] = {&f->n, &f->e, &f->u, &f->x, &f->w};
    for (int i = 0; i < 5; i++) {
        k[i] = p[i] * i_nn + q[i] * i_ne;
        g[i] = p[i] * i_ne + q[i] * i_ee;
        *x[i] += k[i] * v + g[i] * z;
    }
    double *upper = &f->nn;
    for (int i = 0; i < 5; i++) {
        double left_n = k[i] * a + g[i] * b - p[i], left_e = k[i] * b + g[i] * d - q[i];
        for (int j = i; j < 5; j++)
            *upper++ += left_n * k[j] + left_e * g[j] - k[i] * p[j] - g[i] * q[j];
    }
    return nis;
}

static void forget_rate(Filter *f, double variance)
{
    f->w = f->nw = f->ew = f->uw = f->xw = 0.0;
    f->ww = variance;
}

/* P <- J P J' with J = [[a, b], [c, d]] on the third and fourth state. */
static void mix_velocity(Filter *f, double a, double b, double c, double d)
{
    double nu = f->nu, eu = f->eu, uw = f->uw, uu = f->uu, ux = f->ux, xx = f->xx;
    f->nu = a * nu + b * f->nx;
    f->nx = c * nu + d * f->nx;
    f->eu = a * eu + b * f->ex;
    f->ex = c * eu + d * f->ex;
    f->uw = a * uw + b * f->xw;
    f->xw = c * uw + d * f->xw;
    f->uu = a * a * uu + 2 * a * b * ux + b * b * xx;
    f->ux = a * c * uu + (a * d + b * c) * ux + b * d * xx;
    f->xx = c * c * uu + 2 * c * d * ux + d * d * xx;
}

static void settle(Filter *f, const double *model)
{
    const double pi = 3.14159265358979323846;
    double way = model[STEERAGEWAY];
    if (f->mode != UNDERWAY) {
        double variance = 0.5 * (f->uu + f->xx);
        if (f->mode == FIRST) {
            if (variance < 0.5 * model[START_SPEED_VARIANCE])
                f->mode = STARTING;
            return;
        }
        double square = f->u * f->u + f->x * f->x;
        if (square > fmax(16 * variance, way * way)) {
            double speed = sqrt(square), c = f->u / speed, s = f->x / speed;
            f->u = speed;
            f->x = atan2(s, c);
            mix_velocity(f, c, s, -s / speed, c / speed);
            forget_rate(f, model[START_RATE_VARIANCE]);
            f->mode = UNDERWAY;
        } else if (variance < 0.25)
            f->mode = LOW_SPEED;
        return;
    }
    if (f->u < 0.0) {
        f->u = -f->u;
        f->x += pi;
        f->nu = -f->nu;
        f->eu = -f->eu;
        f->ux = -f->ux;
        f->uw = -f->uw;
    }
    if (!(f->x >= -pi && f->x < pi))
        f->x -= 2 * pi * floor((f->x + pi) / (2 * pi));
    if (f->xx > 1.0 || f->u < fmax(2 * sqrt(f->uu), 0.5 * way)) {
        double c = cos(f->x), s = sin(f->x), u = f->u;
        f->u = u * c;
        f->x = u * s;
        mix_velocity(f, c, -u * s, s, u * c);
        forget_rate(f, model[START_RATE_VARIANCE]);
        f->mode = LOW_SPEED;
    }
}

static void speak(const Filter *f, double nis, double *said)
{
    said[0] = f->n;
    said[1] = f->e;
    said[8] = sqrt(0.5 * (f->nn + f->ee));
    said[9] = nis;
    for (int i = 2; i < 8; i++)
        said[i] = NAN;
    if (f->mode == UNDERWAY) {
        said[2] = f->u;
        said[3] = f->x;
        said[4] = f->w;
        said[5] = sqrt(f->uu);
        said[6] = sqrt(f->xx);
        said[7] = sqrt(f->ww);
    } else if (f->mode == LOW_SPEED) {
        said[2] = sqrt(f->u * f->u + f->x * f->x);
        said[5] = sqrt(0.5 * (f->uu + f->xx));
    }
}

/* Tracks behind one another, track i in rows bounds[i] to bounds[i + 1]; north is NAN where a row is no fix. */
void five_state_tracks(size_t tracks, const long long *bounds, const double *time, const double *north,
                       const double *east, const double *model, double *said)
{
    Step step = {.dt = 0.0};
    for (size_t i = 0; i < tracks; i++) {
        Filter f = {.mode = EMPTY};
        for (long long k = bounds[i]; k < bounds[i + 1]; k++) {
            double dt = k > bounds[i] ? time[k] - time[k - 1] : 0.0, nis = NAN;
            if (dt > 0.0 && f.mode != EMPTY) {
                if (dt != step.dt)
                    step = step_of(dt, model);
                if (f.mode == UNDERWAY)
                    predict(&f, &step, model[SPEED_NOISE]);
                else
                    predict_adrift(&f, &step, model);
            }
            if (isfinite(north[k])) {
                if (f.mode == EMPTY)
                    start(&f, north[k], east[k], model);
                else
                    nis = correct(&f, north[k], east[k], model);
                settle(&f, model);
            }
            speak(&f, nis, said + SAID * k);
        }
    }
}
