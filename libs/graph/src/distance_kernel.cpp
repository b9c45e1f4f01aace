// SPDX-License-Identifier: BSD-3-Clause
#include "distance_kernel.h"

#include <array>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "distance_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace riftmap::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<float, 16>;
constexpr D d;

std::uint64_t withinOf(const Page& page, const float* point, float limit) {
    constexpr std::uint32_t kAll = Page::kSize;
    const auto step = static_cast<std::uint32_t>(hn::Lanes(d));
    std::uint64_t within = 0;
    for (std::uint32_t slot = 0; slot < kAll; slot += step) {
        const auto dx = hn::Sub(hn::LoadU(d, page.x.data() + slot), hn::Set(d, point[0]));
        const auto dy = hn::Sub(hn::LoadU(d, page.y.data() + slot), hn::Set(d, point[1]));
        const auto dz = hn::Sub(hn::LoadU(d, page.z.data() + slot), hn::Set(d, point[2]));
        const auto squared = hn::Add(hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy)), hn::Mul(dz, dz));
        std::array<std::uint8_t, 8> mask{};
        hn::StoreMaskBits(d, hn::Le(squared, hn::Set(d, limit)), mask.data());
        within |= std::uint64_t{unsigned{mask[0]} | (unsigned{mask[1]} << 8U)} << slot;
    }
    return within & page.alive;
}

}  // namespace
}  // namespace riftmap::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace riftmap {

HWY_EXPORT(withinOf);

std::uint64_t verticesWithin(const Page& page, const Eigen::Vector3f& point, float limit) {
    return HWY_DYNAMIC_DISPATCH(withinOf)(page, point.data(), limit);
}

}  // namespace riftmap
#endif
