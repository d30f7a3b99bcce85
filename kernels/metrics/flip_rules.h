// SPDX-License-Identifier: Apache-2.0
// Arithmetic of one pixel of LDR-FLIP after Andersson, Nilsson, Akenine-Moeller, Oskarsson, Astrom and Fairchild,
// "FLIP: A Difference Evaluator for Alternating Images", Proc. ACM Comput. Graph. Interact. Tech. 3(2), 2020; equal on
// a CPU and a GPU. Written from the paper's equations.
#pragma once

#include <gsc/hostdev.h>

#include <cmath>

namespace gsc {

constexpr double kFlipColorExponent = 0.7;   // exponent of colour differences, q_c in the paper
constexpr double kFlipFeatureExponent = 0.5; // exponent of feature differences, q_f in the paper
constexpr double kFlipColorKnee = 0.4;       // p_c in the paper: the knee, as a share of the largest colour difference
constexpr double kFlipColorKneeValue = 0.95; // p_t in the paper: value of a colour error at the knee

struct Vec3d {
    double x, y, z;
};

// Matrix from linear sRGB to CIE XYZ (D65), row by row; its inverse is computed from cofactors. The white point is the
// image of (1, 1, 1), so that grey has no chroma.
constexpr double kXyzA = 0.4124564, kXyzB = 0.3575761, kXyzC = 0.1804375, kXyzD = 0.2126729, kXyzE = 0.7151522,
                 kXyzF = 0.0721750, kXyzG = 0.0193339, kXyzH = 0.1191920, kXyzI = 0.9503041;
constexpr double kXyzDeterminant = kXyzA * (kXyzE * kXyzI - kXyzF * kXyzH) - kXyzB * (kXyzD * kXyzI - kXyzF * kXyzG) +
                                   kXyzC * (kXyzD * kXyzH - kXyzE * kXyzG);
constexpr double kWhiteX = kXyzA + kXyzB + kXyzC, kWhiteY = kXyzD + kXyzE + kXyzF, kWhiteZ = kXyzG + kXyzH + kXyzI;

GSC_HD Vec3d xyzOverWhite(const Vec3d& linear)
{
    return {(kXyzA * linear.x + kXyzB * linear.y + kXyzC * linear.z) / kWhiteX,
            (kXyzD * linear.x + kXyzE * linear.y + kXyzF * linear.z) / kWhiteY,
            (kXyzG * linear.x + kXyzH * linear.y + kXyzI * linear.z) / kWhiteZ};
}

GSC_HD Vec3d linearFromXyz(double x, double y, double z)
{
    constexpr double a = (kXyzE * kXyzI - kXyzF * kXyzH) / kXyzDeterminant;
    constexpr double b = (kXyzC * kXyzH - kXyzB * kXyzI) / kXyzDeterminant;
    constexpr double c = (kXyzB * kXyzF - kXyzC * kXyzE) / kXyzDeterminant;
    constexpr double d = (kXyzF * kXyzG - kXyzD * kXyzI) / kXyzDeterminant;
    constexpr double e = (kXyzA * kXyzI - kXyzC * kXyzG) / kXyzDeterminant;
    constexpr double f = (kXyzC * kXyzD - kXyzA * kXyzF) / kXyzDeterminant;
    constexpr double g = (kXyzD * kXyzH - kXyzE * kXyzG) / kXyzDeterminant;
    constexpr double h = (kXyzB * kXyzG - kXyzA * kXyzH) / kXyzDeterminant;
    constexpr double i = (kXyzA * kXyzE - kXyzB * kXyzD) / kXyzDeterminant;
    return {a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z};
}

GSC_HD double unitClamped(double value)
{
    return value > 0 ? (value < 1.0 ? value : 1.0) : 0.0; // 0 for NaN
}

GSC_HD double linearFromSrgb(double value)
{
    const double v = unitClamped(value);
    return v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4);
}

// YCxCz of a display-encoded pixel: achromatic, red-green and blue-yellow.
GSC_HD Vec3d opponentOf(const float* rgb)
{
    const Vec3d xyz =
        xyzOverWhite({linearFromSrgb(double(rgb[0])), linearFromSrgb(double(rgb[1])), linearFromSrgb(double(rgb[2]))});
    return {116 * xyz.y - 16, 500 * (xyz.x - xyz.y), 200 * (xyz.y - xyz.z)};
}

GSC_HD double labCurve(double t)
{
    constexpr double kDelta = 6.0 / 29.0;
    return t > kDelta * kDelta * kDelta ? cbrt(t) : t / (3 * kDelta * kDelta) + 4.0 / 29.0;
}

// CIELAB colour whose chroma is scaled with lightness, for the Hunt effect.
GSC_HD Vec3d huntLab(const Vec3d& linear)
{
    const Vec3d xyz = xyzOverWhite(linear);
    const double fx = labCurve(xyz.x), fy = labCurve(xyz.y), fz = labCurve(xyz.z);
    const double lightness = 116 * fy - 16;
    return {lightness, 0.01 * lightness * 500 * (fx - fy), 0.01 * lightness * 200 * (fy - fz)};
}

// huntLab() of a filtered pixel that is given in YCxCz.
GSC_HD Vec3d huntLabOfOpponent(float achromatic, float red_green, float blue_yellow)
{
    const double y = (double(achromatic) + 16) / 116;
    const Vec3d linear =
        linearFromXyz((double(red_green) / 500 + y) * kWhiteX, y * kWhiteY, (y - double(blue_yellow) / 200) * kWhiteZ);
    return huntLab({unitClamped(linear.x), unitClamped(linear.y), unitClamped(linear.z)});
}

GSC_HD double hyAb(const Vec3d& a, const Vec3d& b)
{
    return fabs(a.x - b.x) + hypot(a.y - b.y, a.z - b.z);
}

// Difference between green and blue, the largest that a display can show.
GSC_HD double largestFlipColor()
{
    return pow(hyAb(huntLab({0, 1, 0}), huntLab({0, 0, 1})), kFlipColorExponent);
}

// Colour difference of two pixels, 0 to 1, linear up to the knee and compressed above it. `largest`:
// largestFlipColor().
GSC_HD double flipColorError(const Vec3d& a, const Vec3d& b, double largest)
{
    const double difference = pow(hyAb(a, b), kFlipColorExponent), knee = kFlipColorKnee * largest;
    return difference < knee ? kFlipColorKneeValue / knee * difference
                             : kFlipColorKneeValue + (difference - knee) / (largest - knee) * (1 - kFlipColorKneeValue);
}

// Strength of edges and of points in the achromatic plane at a pixel.
struct FlipFeatures {
    float edge, point;
};

GSC_HD double flipPixel(float color_error, const FlipFeatures& a, const FlipFeatures& b)
{
    constexpr double kRootTwo = 1.41421356237309504880;
    const double edge = fabs(double(a.edge) - double(b.edge)), point = fabs(double(a.point - b.point));
    const double feature = (edge > point ? edge : point) / kRootTwo;
    return pow(double(color_error), 1 - pow(feature < 1.0 ? feature : 1.0, kFlipFeatureExponent));
}

} // namespace gsc
