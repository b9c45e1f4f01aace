// SPDX-License-Identifier: BSD-3-Clause
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "solid_noise.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// foreach_target compiles this file once a target: no #pragma once, but this guard where needed.
#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "random_bits.h"
#include "solid_noise.h"

HWY_BEFORE_NAMESPACE();
namespace riftmap::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, 16>;
using Words = hn::RebindToUnsigned<Floats>;
using Signed = hn::RebindToSigned<Floats>;
using F = hn::Vec<Floats>;
using U = hn::Vec<Words>;

/// -1 .. 1 for a lattice point whose coordinates were multiplied by three large odd numbers.
HWY_INLINE F latticeValue(U x, U y, U z) {
    const Floats f;
    const Words u;
    U h = hn::Xor(hn::Xor(x, y), z);
    h = hn::Mul(hn::Xor(h, hn::ShiftRight<15>(h)), hn::Set(u, 0x2C1B3C6DU));
    h = hn::Mul(hn::Xor(h, hn::ShiftRight<12>(h)), hn::Set(u, 0x297A2D39U));
    const auto high = hn::BitCast(Signed(), hn::ShiftRight<16>(h));
    return hn::Sub(hn::Mul(hn::ConvertTo(f, high), hn::Set(f, 1.0F / 32767.5F)), hn::Set(f, 1.0F));
}

HWY_INLINE F smooth(F t) {
    const Floats f;
    return hn::Mul(hn::Mul(t, t), hn::Sub(hn::Set(f, 3.0F), hn::Add(t, t)));
}

HWY_INLINE F between(F a, F b, F weight) {
    return hn::Add(a, hn::Mul(weight, hn::Sub(b, a)));
}

/// Value noise on the unit lattice.
HWY_INLINE F valueNoise(F x, F y, F z) {
    const Floats f;
    const Words u;
    const Signed s;
    const F fx = hn::Floor(x);
    const F fy = hn::Floor(y);
    const F fz = hn::Floor(z);
    const U kx = hn::Set(u, 0x9E3779B1U);
    const U ky = hn::Set(u, 0x85EBCA77U);
    const U kz = hn::Set(u, 0xC2B2AE3DU);
    const U x0 = hn::Mul(hn::BitCast(u, hn::ConvertTo(s, fx)), kx);
    const U y0 = hn::Mul(hn::BitCast(u, hn::ConvertTo(s, fy)), ky);
    const U z0 = hn::Mul(hn::BitCast(u, hn::ConvertTo(s, fz)), kz);
    const U x1 = hn::Add(x0, kx);
    const U y1 = hn::Add(y0, ky);
    const U z1 = hn::Add(z0, kz);
    const F wx = smooth(hn::Sub(x, fx));
    const F wy = smooth(hn::Sub(y, fy));
    const F wz = smooth(hn::Sub(z, fz));
    const F low = between(between(latticeValue(x0, y0, z0), latticeValue(x1, y0, z0), wx),
                          between(latticeValue(x0, y1, z0), latticeValue(x1, y1, z0), wx), wy);
    const F high = between(between(latticeValue(x0, y0, z1), latticeValue(x1, y0, z1), wx),
                           between(latticeValue(x0, y1, z1), latticeValue(x1, y1, z1), wx), wy);
    (void)f;
    return between(low, high, wz);
}

HWY_INLINE F dot(const Eigen::Matrix3f& m, int row, F x, F y, F z) {
    const Floats f;
    return hn::Add(hn::Add(hn::Mul(hn::Set(f, m(row, 0)), x), hn::Mul(hn::Set(f, m(row, 1)), y)),
                   hn::Mul(hn::Set(f, m(row, 2)), z));
}

void solidNoiseBlock(const NoiseQueries& q, std::size_t i, float* out) {
    const Floats f;
    const F px = hn::LoadU(f, &q.x[i]);
    const F py = hn::LoadU(f, &q.y[i]);
    const F pz = hn::LoadU(f, &q.z[i]);
    const F pixel = hn::LoadU(f, &q.footprint[i]);
    F size = hn::LoadU(f, &q.size[i]);
    F sum = hn::Zero(f);
    for (std::size_t octave = 0; octave < kNoiseOctaves; ++octave) {
        // Fades out from three pixels a blotch to one: below, it would flicker.
        const F resolved =
            hn::Mul(hn::Sub(hn::Div(size, pixel), hn::Set(f, 1.0F)), hn::Set(f, 0.5F));
        if (hn::AllFalse(f, hn::Gt(resolved, hn::Zero(f)))) {
            break;
        }
        const F weight = hn::Max(hn::Zero(f), hn::Min(resolved, hn::Set(f, 1.0F)));
        const F scale = hn::Div(hn::Set(f, 1.0F), size);
        const Eigen::Matrix3f& r = noiseRotation(octave);
        const F n =
            valueNoise(hn::Mul(dot(r, 0, px, py, pz), scale), hn::Mul(dot(r, 1, px, py, pz), scale),
                       hn::Mul(dot(r, 2, px, py, pz), scale));
        sum = hn::Add(sum, hn::Mul(hn::Mul(weight, hn::Set(f, noiseContrast(octave))), n));
        size = hn::Mul(size, hn::Set(f, 0.5F));
    }
    hn::StoreU(sum, f, out);
}

void solidNoiseAll(const NoiseQueries& queries, std::size_t padded, float* out) {
    for (std::size_t i = 0; i < padded; i += hn::Lanes(Floats())) {
        solidNoiseBlock(queries, i, out + i);
    }
}

}  // namespace riftmap::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace riftmap {

HWY_EXPORT(solidNoiseAll);

void NoiseQueries::resize(std::size_t count) {
    for (auto* v : {&x, &y, &z, &size, &footprint}) {
        v->resize(count, 1.0F);
    }
}

void solidNoise(NoiseQueries& queries, std::vector<float>& noise) {
    const std::size_t n = queries.count();
    const std::size_t padded = (n + 15) / 16 * 16;
    queries.resize(padded);
    noise.resize(padded);
    HWY_DYNAMIC_DISPATCH(solidNoiseAll)(queries, padded, noise.data());
    queries.resize(n);
    noise.resize(n);
}

const Eigen::Matrix3f& noiseRotation(std::size_t octave) {
    static const auto rotations = [] {
        std::array<Eigen::Matrix3f, kNoiseOctaves> r;
        for (std::size_t i = 0; i < kNoiseOctaves; ++i) {
            // From a quaternion of rational numbers: no sines, the same bits everywhere.
            const auto part = [&](std::uint64_t k) {
                return static_cast<double>(mixBits(i, k) % 2001) / 1000.0 - 1.0;
            };
            r[i] = Eigen::Quaterniond(1.0 + std::abs(part(0)), part(1), part(2), part(3))
                       .normalized()
                       .toRotationMatrix()
                       .cast<float>();
        }
        return r;
    }();
    return rotations[octave];
}

float noiseContrast(std::size_t octave) {
    constexpr std::array<float, 4> kHeldBack = {0.08F, 0.12F, 0.15F, 0.18F};
    return octave < kHeldBack.size() ? kHeldBack[octave] : 0.21F;
}

}  // namespace riftmap
#endif
