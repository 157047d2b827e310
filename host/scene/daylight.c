// The sky's colors are those of Preetham, Shirley, Smits, A practical analytic model for daylight, SIGGRAPH
// 1999, sections 2 and 3 and appendix. All functions are portable, so that images are equal everywhere.
#include "host/scene/daylight.h"
#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/scene/portable.h"

#define DEGREE (M_PI / 180)

double days_from_epoch(int year, int month, int day)
{
    // Meeus, Astronomical algorithms, 1998, chapter 7, with January and February in the year before
    const int y = month > 2 ? year : year - 1, m = month > 2 ? month : month + 12, century = y / 100;
    const int days = 1461 * (y + 4716) / 4 + 306001 * (m + 1) / 10000 + day + 2 - century + century / 4;
    return days - 1524.5 - 2451545;
}

// Meeus, Astronomical algorithms, 1998, chapters 12, 13, 16 and 25 (low accuracy, 0.01 degrees). Nutation and
// aberration, 0.01 degrees, are left out, and so is the difference between universal and dynamical time.
SunPosition sun_position(double latitude, double longitude, double days)
{
    const double t = days / 36525;
    const double anomaly = (357.52911 + 35999.05029 * t - 0.0001537 * t * t) * DEGREE;
    const double center = (1.914602 - 0.004817 * t - 0.000014 * t * t) * portable_sine(anomaly) +
                          (0.019993 - 0.000101 * t) * portable_sine(2 * anomaly) +
                          0.000289 * portable_sine(3 * anomaly);
    const double along = (280.46646 + 36000.76983 * t + 0.0003032 * t * t + center) * DEGREE;
    const double obliquity = (23.439291 - 0.0130042 * t) * DEGREE;
    const Vector3 sun = {portable_cosine(along), portable_cosine(obliquity) * portable_sine(along),
                         portable_sine(obliquity) * portable_sine(along)};
    const double sidereal = (280.46061837 + 360.98564736629 * days + longitude) * DEGREE;
    const double meridian = sun.x * portable_cosine(sidereal) + sun.y * portable_sine(sidereal);
    const double east = sun.y * portable_cosine(sidereal) - sun.x * portable_sine(sidereal);
    const double sine = portable_sine(latitude * DEGREE), cosine = portable_cosine(latitude * DEGREE);
    const double north = cosine * sun.z - sine * meridian, up = sine * sun.z + cosine * meridian;
    const double elevation = portable_angle(up, sqrt(north * north + east * east)) / DEGREE;
    // the formula for refraction, of Saemundsson, holds above the horizon
    const double high = fmax(elevation, -1);
    const double refraction = 1.02 / 60 / portable_tangent((high + 10.3 / (high + 5.11)) * DEGREE);
    return (SunPosition){elevation + refraction, portable_angle(east, north) / DEGREE};
}

// Returns the part of a disc of 0.53 degrees that is above the horizon, nearly.
static double part_risen(double elevation)
{
    return fmin(fmax(0.5 + elevation / 0.53, 0), 1);
}

Color sun_color(double elevation, double turbidity)
{
    // Without air the sun gives 128,000 lx (IESNA lighting handbook, 2000, chapter 8) and is a black body of
    // 5772 K (IAU resolution 2015 B3). At 650, 550 and 450 nm the air takes away by scattering at molecules,
    // 0.008735 w^-4.08 for w in micrometers, at aerosols, w^-1.3 times a factor, and by 0.35 cm of ozone.
    static const double outside[] = {1.28 * 1.119, 1.28 * 0.974, 1.28 * 0.907};
    static const double molecules[] = {0.05065, 0.10013, 0.22707}, aerosols[] = {1.7507, 2.1753, 2.8237};
    static const double ozone[] = {0.35 * 0.067, 0.35 * 0.085, 0.35 * 0.003};
    const double risen = part_risen(elevation), high = fmax(elevation, -0.5);
    const double mass = 1 / (portable_sine(high * DEGREE) + 0.15 * portable_power(high + 3.885, -1.253));
    double color[3];
    for (size_t i = 0; i < 3; i++) {
        const double thickness = molecules[i] + (0.04608 * turbidity - 0.04586) * aerosols[i] + ozone[i];
        color[i] = risen * outside[i] * portable_exponential(-mass * thickness);
    }
    return (Color){color[0], color[1], color[2]};
}

// The distribution of Perez: (1 + a exp(b / sine)) (1 + c exp(d angle) + e cosine^2) for the sine of a
// direction's elevation and its angle to the sun.
typedef struct {
    double a, b, c, d, e;
} Perez;

static double perez_of_height(const Perez *perez, double sine)
{
    return 1 + perez->a * portable_exponential(perez->b / sine);
}

static double perez_of_angle(const Perez *perez, double angle, double cosine)
{
    return 1 + perez->c * portable_exponential(perez->d * angle) + perez->e * cosine * cosine;
}

// Texels of 0.7 degrees. Between them colors are within 1 % of the model's where the sun is 20 degrees high
// or more, and within 6 % in the glow around a lower one.
enum { IMAGE_WIDTH = 512, IMAGE_HEIGHT = IMAGE_WIDTH / 2, HORIZON = IMAGE_HEIGHT / 2 };

typedef struct {
    double sun_sine, sun_cosine; // of its elevation
    double fading;
    // of the luminance and the chromaticities x and y
    Perez perez[3];
    double scales[3];                // to what the distribution is in the zenith
    double cosines[IMAGE_WIDTH / 2]; // of the azimuths of the columns right of the sun
    float *values;
} Sky;

// Sets what depends on the sun and the air.
static Sky sky_open(double elevation, double turbidity)
{
    static const double slopes[3][5] = {{0.1787, -0.3554, -0.0227, 0.1206, -0.0670},
                                        {-0.0193, -0.0665, -0.0004, -0.0641, -0.0033},
                                        {-0.0167, -0.0950, -0.0079, -0.0441, -0.0109}};
    static const double offsets[3][5] = {{-1.4630, 0.4275, 5.3251, -2.5771, 0.3703},
                                         {-0.2592, 0.0008, 0.2125, -0.8989, 0.0452},
                                         {-0.2608, 0.0092, 0.2102, -1.6537, 0.0529}};
    // of the zenith's chromaticity: powers of the turbidity from the second, by those of the sun's angle to
    // the zenith from the third
    static const double zeniths[2][3][4] = {{{0.00166, -0.00375, 0.00209, 0},
                                             {-0.02903, 0.06377, -0.03202, 0.00394},
                                             {0.11693, -0.21196, 0.06052, 0.25886}},
                                            {{0.00275, -0.00610, 0.00317, 0},
                                             {-0.04214, 0.08970, -0.04153, 0.00516},
                                             {0.15346, -0.26756, 0.06670, 0.26688}}};
    const double high = fmax(elevation, 0), angle = (90 - high) * DEGREE;
    // A clear sky's light falls from about 500 lx at sunset to 3 lx at -6 degrees (AMS, Glossary of
    // meteorology, 2012, civil twilight).
    Sky sky = {.sun_sine = portable_sine(high * DEGREE),
               .sun_cosine = portable_cosine(high * DEGREE),
               .fading = portable_power(10, fmin(elevation, 0) / 2.6)};
    const double bend = (4.0 / 9 - turbidity / 120) * (M_PI - 2 * angle);
    double zenith[3] = {(4.0453 * turbidity - 4.9710) * portable_tangent(bend) - 0.2155 * turbidity + 2.4192};
    for (size_t i = 0; i < 2; i++)
        for (size_t row = 0; row < 3; row++) {
            const double *k = zeniths[i][row];
            zenith[1 + i] = zenith[1 + i] * turbidity + ((k[0] * angle + k[1]) * angle + k[2]) * angle + k[3];
        }
    for (size_t i = 0; i < 3; i++) {
        double k[5];
        for (size_t j = 0; j < 5; j++)
            k[j] = slopes[i][j] * turbidity + offsets[i][j];
        sky.perez[i] = (Perez){k[0], k[1], k[2], k[3], k[4]};
        sky.scales[i] = zenith[i] / (perez_of_height(&sky.perez[i], 1) *
                                     perez_of_angle(&sky.perez[i], angle, sky.sun_sine));
    }
    for (size_t x = 0; x < IMAGE_WIDTH / 2; x++)
        sky.cosines[x] = portable_cosine(((double)x + 0.5) * (2 * M_PI / IMAGE_WIDTH));
    return sky;
}

// Converts a luminance in kcd/m^2 and a chromaticity to linear sRGB (IEC 61966-2-1). Where the model leaves
// its gamut, next to a low sun, blue is 0.
static void texel_convert(float *texel, double luminance, double x, double y)
{
    const double big_y = luminance * (M_PI / 100), big_x = big_y * x / y, big_z = big_y * (1 - x - y) / y;
    texel[0] = (float)fmax(3.2406 * big_x - 1.5372 * big_y - 0.4986 * big_z, 0);
    texel[1] = (float)fmax(-0.9689 * big_x + 1.8758 * big_y + 0.0415 * big_z, 0);
    texel[2] = (float)fmax(0.0557 * big_x - 0.2040 * big_y + 1.0570 * big_z, 0);
}

// Fills rows above the horizon, whose halves mirror each other.
static void rows_fill(void *context, size_t begin, size_t end)
{
    const Sky *sky = context;
    for (size_t y = begin; y < end; y++) {
        const double elevation = (HORIZON - ((double)y + 0.5)) * M_PI / IMAGE_HEIGHT;
        const double sine = portable_sine(elevation), across = portable_cosine(elevation) * sky->sun_cosine;
        double row[3];
        for (size_t i = 0; i < 3; i++)
            row[i] = sky->scales[i] * perez_of_height(&sky->perez[i], sine);
        for (size_t x = 0; x < IMAGE_WIDTH / 2; x++) {
            const double cosine = sine * sky->sun_sine + across * sky->cosines[x];
            const double angle = portable_arccosine(fmax(fmin(cosine, 1), -1));
            double color[3];
            for (size_t i = 0; i < 3; i++)
                color[i] = row[i] * perez_of_angle(&sky->perez[i], angle, cosine);
            float *right = sky->values + 3 * (y * IMAGE_WIDTH + IMAGE_WIDTH / 2 + x);
            float *left = sky->values + 3 * (y * IMAGE_WIDTH + IMAGE_WIDTH / 2 - 1 - x);
            texel_convert(right, sky->fading * color[0], color[1], color[2]);
            for (size_t i = 0; i < 3; i++)
                left[i] = right[i];
        }
    }
}

// Returns the color of a white level surface under the sky, the mean weighted by the sine of the elevation.
static Color sky_level_color(const Sky *sky)
{
    Color sum = {0};
    double above = 1;
    for (size_t y = 0; y < HORIZON; y++) {
        const double sine = portable_cosine((double)(y + 1) * M_PI / IMAGE_HEIGHT), below = sine * sine;
        for (size_t x = 0; x < IMAGE_WIDTH; x++) {
            const float *texel = sky->values + 3 * (y * IMAGE_WIDTH + x);
            const Color color = {texel[0], texel[1], texel[2]};
            sum = vector_add(sum, vector_scale(color, (above - below) / IMAGE_WIDTH));
        }
        above = below;
    }
    return sum;
}

Image daylight_image(double elevation, double turbidity, Color ground)
{
    const size_t half = 3 * HORIZON * IMAGE_WIDTH;
    float *values = memory_allocate(2 * half, sizeof *values);
    Sky sky = sky_open(elevation, turbidity);
    sky.values = values;
    parallel_run(HORIZON, 8, rows_fill, &sky);
    const Color sun = vector_scale(sun_color(elevation, turbidity), sky.sun_sine);
    const Color below = vector_multiply(ground, vector_add(sky_level_color(&sky), sun));
    for (size_t i = half; i < 2 * half; i += 3) {
        values[i] = (float)below.x;
        values[i + 1] = (float)below.y;
        values[i + 2] = (float)below.z;
    }
    return (Image){.width = IMAGE_WIDTH, .height = IMAGE_HEIGHT, .channels = 3, .values = values};
}
