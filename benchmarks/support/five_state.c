/* The plain five-state filter written by hand, as for a microcontroller: the reference of the benchmarks.
 *
 * Same arithmetic as src/steerway/estimation/filter/five_state.py: exact turn, spectral densities, the velocity across
 * the course for the course in the covariance, of which the upper triangle is kept, and fixes weighed against outliers.
 * In a fixed plane, with steps of at most 3 s, and without what that file leaves to the general filter: more outliers
 * than good fixes (the row is left as it is), a lost course. What depends on the time step alone is computed when the
 * step changes, as there.
 */

#include <math.h>
#include <stddef.h>

/* Indices of `model`, which `by_hand.py` fills. */
enum { SPEED_NOISE, SPEED_DECAY, RATE_NOISE, RATE_DECAY, DRIFT_SPEED, START_RATE, FIX_VARIANCE, OUTLIER_RATE };
enum { SAID = 10 };
static const double PI = 3.14159265358979323846;

typedef struct {
    double dt, left, way, rate_left, turn, lean;
    double uu, lu, ll, ww, xw, xx, yw, yx, yy;
} Step;

typedef struct {
    int started;
    double was_outlier;
    double n, e, u, x, w;
    double nn, ne, nu, nx, nw, ee, eu, ex, ew, uu, ux, uw, xx, xw, ww; /* x: velocity across the course */
} Filter;

static void decaying(double rate, double t, double *left, double *once, double *twice)
{
    double a = rate * t;
    if (fabs(a) < 0.1) {
        double f = 0.5 - a * (1.0 / 6 - a * (1.0 / 24 - a * (1.0 / 120 - a * (1.0 / 720 - a / 5040))));
        double g = 1.0 - a * f;
        *left = 1.0 - a * g;
        *once = t * g;
        *twice = t * t * f;
        return;
    }
    *left = exp(-a);
    *once = -expm1(-a) / rate;
    *twice = (t - *once) / rate;
}

static Step step_of(double dt, const double *model)
{
    Step s = {.dt = dt};
    double area, unused, half = 0.5 * sqrt(0.6);
    decaying(model[SPEED_DECAY], dt, &s.left, &s.way, &unused);
    decaying(model[RATE_DECAY], dt, &s.rate_left, &s.turn, &area);
    s.lean = area / dt;
    for (int k = -1; k < 2; k++) {
        double a, b, c, part = dt * (0.5 + k * half), share = dt * (k == 0 ? 8.0 / 18 : 5.0 / 18), weight;
        decaying(model[SPEED_DECAY], part, &a, &b, &c);
        weight = model[SPEED_NOISE] * share;
        s.uu += weight * a * a;
        s.lu += weight * b * a;
        s.ll += weight * b * b;
        decaying(model[RATE_DECAY], part, &a, &b, &c);
        weight = model[RATE_NOISE] * share;
        s.ww += weight * a * a;
        s.xw += weight * b * a;
        s.xx += weight * b * b;
        s.yw += weight * c * a;
        s.yx += weight * c * b;
        s.yy += weight * c * c;
    }
    return s;
}

static double wrapped(double angle)
{
    return angle >= -PI && angle < PI ? angle : angle - 2 * PI * floor((angle + PI) / (2 * PI));
}

static void predict(Filter *f, const Step *k, const double *model)
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
    double a = k->way * ratio, bend = 0.5 * slope * u * k->way * k->turn, lean = k->lean * u * a;
    double n_u = a * c, n_x = -a * s, n_w = bend * c - lean * s, e_u = a * s, e_x = a * c, e_w = bend * s + lean * c;
    double left = k->left, b = k->rate_left, now = u * left, x_w = now * k->turn;
    f->n += u * n_u;
    f->e += u * e_u;
    f->u = now;
    f->x = wrapped(f->x + k->turn * f->w);
    f->w *= b;

    double n0 = f->nn + n_u * f->nu + n_x * f->nx + n_w * f->nw, n1 = f->ne + n_u * f->eu + n_x * f->ex + n_w * f->ew;
    double n2 = f->nu + n_u * f->uu + n_x * f->ux + n_w * f->uw, n3 = f->nx + n_u * f->ux + n_x * f->xx + n_w * f->xw;
    double n4 = f->nw + n_u * f->uw + n_x * f->xw + n_w * f->ww;
    double e1 = f->ee + e_u * f->eu + e_x * f->ex + e_w * f->ew, e2 = f->eu + e_u * f->uu + e_x * f->ux + e_w * f->uw;
    double e3 = f->ex + e_u * f->ux + e_x * f->xx + e_w * f->xw, e4 = f->ew + e_u * f->uw + e_x * f->xw + e_w * f->ww;
    double x3 = left * f->xx + x_w * f->xw, x4 = left * f->xw + x_w * f->ww;
    double slowness = now / model[DRIFT_SPEED], drift;
    slowness *= slowness;
    drift = 1.0 / (1.0 + slowness * slowness);
    double yy = u * u * k->yy + drift * k->ll, yx = u * now * k->yx + drift * k->lu, yw = u * k->yw;

    f->nn = n0 + n_u * n2 + n_x * n3 + n_w * n4 + c * c * k->ll + s * s * yy;
    f->ne = n1 + e_u * n2 + e_x * n3 + e_w * n4 + c * s * (k->ll - yy);
    f->nu = left * n2 + c * k->lu;
    f->nx = left * n3 + x_w * n4 - s * yx;
    f->nw = b * n4 - s * yw;
    f->ee = e1 + e_u * e2 + e_x * e3 + e_w * e4 + s * s * k->ll + c * c * yy;
    f->eu = left * e2 + s * k->lu;
    f->ex = left * e3 + x_w * e4 + c * yx;
    f->ew = b * e4 + c * yw;
    f->ux = left * (left * f->ux + x_w * f->uw);
    f->uu = left * left * f->uu + k->uu;
    f->uw *= left * b;
    f->xx = left * x3 + x_w * x4 + now * now * k->xx + drift * k->uu;
    f->xw = b * x4 + now * k->xw;
    f->ww = b * b * f->ww + k->ww;
}

static void start(Filter *f, double north, double east, const double *model)
{
    *f = (Filter){.started = 1, .n = north, .e = east, .uu = 100.0, .xx = 100.0, .ww = model[START_RATE],
                  .nn = model[FIX_VARIANCE], .ee = model[FIX_VARIANCE]};
}

/* Move the velocity by (along, across): as a turn where the vessel has way, else as a vector. */
static void move_velocity(Filter *f, double along, double across)
{
    double speed = f->u, furthest = fmax(f->xx, across * across), way = speed * speed;
    int steady = way > 9.0 * furthest || way > fmax(9.0 * fmax(f->uu, along * along), furthest);
    if (f->uu > 0.5 * f->xx)
        steady = way > 25.0 * furthest;
    if (steady && speed > 0.0 && speed + along > 0.0) {
        double factor = (speed + along) / speed;
        f->u = speed + along;
        f->x = wrapped(f->x + across / speed);
        f->nx *= factor;
        f->ex *= factor;
        f->ux *= factor;
        f->xw *= factor;
        f->xx *= factor * factor;
        return;
    }
    double angle = atan2(across, speed + along), c = cos(angle), s = sin(angle);
    f->u = hypot(speed + along, across);
    f->x = wrapped(f->x + angle);
    double nu = f->nu, eu = f->eu, uw = f->uw, uu = f->uu, ux = f->ux, xx = f->xx;
    f->nu = c * nu + s * f->nx;
    f->nx = c * f->nx - s * nu;
    f->eu = c * eu + s * f->ex;
    f->ex = c * f->ex - s * eu;
    f->uw = c * uw + s * f->xw;
    f->xw = c * f->xw - s * uw;
    f->uu = c * c * uu + 2 * c * s * ux + s * s * xx;
    f->ux = c * s * (xx - uu) + (c * c - s * s) * ux;
    f->xx = s * s * uu - 2 * c * s * ux + c * c * xx;
}

static double correct(Filter *f, double north, double east, const double *model)
{
    double r = model[FIX_VARIANCE], v = north - f->n, z = east - f->e;
    double a = f->nn + r, b = f->ne, d = f->ee + r, determinant = a * d - b * b;
    double i_nn = d / determinant, i_ne = -b / determinant, i_ee = a / determinant;
    double pull_n = i_nn * v + i_ne * z, pull_e = i_ne * v + i_ee * z, nis = v * pull_n + z * pull_e;
    double rate = model[OUTLIER_RATE] * (1.0 - f->was_outlier) + 0.5 * f->was_outlier;
    double good = (1.0 - rate) * exp(-0.5 * nis) / (2 * PI * sqrt(determinant));
    double wrong = rate / (2 * PI * 10.0 * (v * v + z * z + a + d + 100.0 * r)), total = good + wrong;
    if (!(wrong < 0.5 * total))
        return NAN;
    f->was_outlier = wrong / total;
    double beta = a + d > 1e6 * r && wrong < 1e-3 * total ? 1.0 : good / total, kept = beta * (1.0 - beta);
    double m_nn = beta * i_nn - kept * pull_n * pull_n, m_ne = beta * i_ne - kept * pull_n * pull_e;
    double m_ee = beta * i_ee - kept * pull_e * pull_e;
    double p[5] = {f->nn, f->ne, f->nu, f->nx, f->nw}, q[5] = {f->ne, f->ee, f->eu, f->ex, f->ew}, moved[5];
    double *upper = &f->nn;
    for (int i = 0; i < 5; i++) {
        double left_n = p[i] * m_nn + q[i] * m_ne, left_e = p[i] * m_ne + q[i] * m_ee;
        moved[i] = beta * (p[i] * pull_n + q[i] * pull_e);
        for (int j = i; j < 5; j++)
            *upper++ -= left_n * p[j] + left_e * q[j];
    }
    f->n += moved[0];
    f->e += moved[1];
    f->w += moved[4];
    move_velocity(f, moved[2], moved[3]);
    return nis;
}

static void speak(const Filter *f, double nis, double *said)
{
    double speed = f->u;
    if (!f->started) {
        for (int i = 0; i < SAID; i++)
            said[i] = NAN;
        return;
    }
    if (!(f->xx < speed * speed || f->xx < 0.16))
        speed = sqrt(speed * speed + 0.25 * PI * (f->uu + f->xx));
    said[0] = f->n;
    said[1] = f->e;
    said[2] = speed;
    said[3] = wrapped(f->x);
    said[4] = f->w;
    said[5] = f->uu;
    said[6] = f->xx / fmax(speed * speed, 1e-12);
    said[7] = f->ww;
    said[8] = 0.5 * (f->nn + f->ee);
    said[9] = nis;
}

/* Tracks one after another, track i in rows bounds[i] to bounds[i + 1]; north is NAN where a row is no fix. */
void five_state_tracks(size_t tracks, const long long *bounds, const double *time, const double *north,
                       const double *east, const double *model, double *said)
{
    Step step = {.dt = 0.0};
    for (size_t i = 0; i < tracks; i++) {
        Filter f = {.started = 0};
        for (long long k = bounds[i]; k < bounds[i + 1]; k++) {
            double dt = k > bounds[i] ? time[k] - time[k - 1] : 0.0, nis = NAN;
            if (dt > 0.0 && f.started) {
                if (fabs(dt - step.dt) > 1e-4 * dt)
                    step = step_of(dt, model);
                predict(&f, &step, model);
            }
            if (isfinite(north[k])) {
                if (f.started)
                    nis = correct(&f, north[k], east[k], model);
                else
                    start(&f, north[k], east[k], model);
            }
            speak(&f, nis, said + SAID * k);
        }
    }
}
