// The sun and the light of a clear sky. A value of 1 is the color of a white diffuse surface under 100,000
// lx.
#pragma once

#include "host/scene/scene.h"

// The sun's position in degrees: its elevation above the horizon, and its azimuth from north to east.
typedef struct {
    double elevation, azimuth;
} SunPosition;

// The turbidities for which the sky is defined, from very clear air to haze.
#define TURBIDITY_MIN 2.0
#define TURBIDITY_MAX 10.0

// Returns the days from 2000-01-01 12:00 UTC to the beginning of a day of the Gregorian calendar.
double days_from_epoch(int year, int month, int day);

// Returns the sun's apparent position for a latitude and a longitude in degrees, the latter positive to the
// east, at a time in days from the epoch.
SunPosition sun_position(double latitude, double longitude, double days);

// Returns the color of the sun as a directional light. The color fades to black as the sun sets.
Color sun_color(double elevation, double turbidity);

// Returns an image of all directions, with the sun's azimuth in its middle. Below the horizon it shows the
// daylight that a ground of this color reflects.
Image daylight_image(double elevation, double turbidity, Color ground);
