// SPDX-License-Identifier: BSD-3-Clause
#include "distance_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "distance_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "slot_bits-inl.h"

HWY_BEFORE_NAMESPACE();
namespace riftmap::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<float, 16>;
constexpr D d;

std::uint64_t withinOf(const Page& page, const float* point, float squaredLimit) {
    const auto step = static_cast<std::uint32_t>(hn::Lanes(d));
    std::uint64_t within = 0;
    for (std::uint32_t slot = 0; slot < Page::kSize; slot += step) {
        const auto dx = hn::Sub(hn::LoadU(d, page.x.data() + slot), hn::Set(d, point[0]));
        const auto dy = hn::Sub(hn::LoadU(d, page.y.data() + slot), hn::Set(d, point[1]));
        const auto dz = hn::Sub(hn::LoadU(d, page.z.data() + slot), hn::Set(d, point[2]));
        const auto squared = hn::Add(hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy)), hn::Mul(dz, dz));
        within |= slotBits(d, hn::Le(squared, hn::Set(d, squaredLimit)), slot);
    }
    return within & page.alive;
}

}  // namespace
}  // namespace riftmap::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace riftmap {

HWY_EXPORT(withinOf);

std::uint64_t verticesWithin(const Page& page, const Eigen::Vector3f& point, float squaredLimit) {
    return HWY_DYNAMIC_DISPATCH(withinOf)(page, point.data(), squaredLimit);
}

}  // namespace riftmap
#endif
