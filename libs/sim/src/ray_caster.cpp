// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/sim/ray_caster.h"

#include <embree3/rtcore.h>
#include <tbb/global_control.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "distance.h"

namespace riftmap {
namespace {

// One instruction set walks the tree, and (see Scene) one thread builds it: which of two triangles
// a ray through their common edge hits then does not depend on the machine. `threads` would limit
// TBB for the whole process: more than any machine has means no limit.
constexpr const char* kDeviceConfig = "threads=4096,isa=sse4.2";

std::string describe(RTCError error) {
    switch (error) {
        case RTC_ERROR_OUT_OF_MEMORY:
            return "out of memory";
        case RTC_ERROR_UNSUPPORTED_CPU:
            return "processor not supported";
        default:
            return "error " + std::to_string(static_cast<int>(error));
    }
}

template <class T>
T* checked(T* pointer) {
    if (pointer == nullptr) {
        throw MeshError("ray caster: " + describe(rtcGetDeviceError(nullptr)));
    }
    return pointer;
}

/// In place: a copy of what was just written in other widths would wait for it.
void setRay(RTCRay& ray, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
            double tNear, double tFar) {
    ray.org_x = static_cast<float>(origin.x());
    ray.org_y = static_cast<float>(origin.y());
    ray.org_z = static_cast<float>(origin.z());
    ray.tnear = static_cast<float>(tNear);
    ray.dir_x = static_cast<float>(direction.x());
    ray.dir_y = static_cast<float>(direction.y());
    ray.dir_z = static_cast<float>(direction.z());
    ray.time = 0;
    ray.tfar = static_cast<float>(tFar);
    ray.mask = ~0U;
    ray.id = 0;
    ray.flags = 0;
}

void setQuery(RTCRayHit& query, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
              double tMax) {
    setRay(query.ray, origin, direction, 0, tMax);
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    query.hit.primID = RTC_INVALID_GEOMETRY_ID;
    query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
}

}  // namespace

struct RayCaster::Scene {
    explicit Scene(const TriangleMesh& mesh) : vertices(mesh.vertices), triangles(mesh.triangles) {
        normals.reserve(triangles.size());
        for (std::size_t i = 0; i < triangles.size(); ++i) {
            normals.push_back(mesh.normal(i));
        }
        device = checked(rtcNewDevice(kDeviceConfig));
        scene = checked(rtcNewScene(device));
        rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
        vertices.reserve(vertices.size() + 1);  // Embree reads 16 bytes from the last vertex
        RTCGeometry geometry = checked(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE));
        rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                   vertices.data(), 0, sizeof(Eigen::Vector3f), vertices.size());
        rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                   triangles.data(), 0, sizeof(std::array<std::uint32_t, 3>),
                                   triangles.size());
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene, geometry);
        rtcReleaseGeometry(geometry);
        commitWithOneThread();
        if (const RTCError error = rtcGetDeviceError(device); error != RTC_ERROR_NONE) {
            release();
            throw MeshError("ray caster: " + riftmap::describe(error));
        }
    }
    ~Scene() { release(); }
    Scene(const Scene&) = delete;
    Scene& operator=(const Scene&) = delete;

    void commitWithOneThread() {
        const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
        rtcCommitScene(scene);
    }

    void release() {
        rtcReleaseScene(scene);
        rtcReleaseDevice(device);
    }

    Triangle corners(std::uint32_t triangle) const {
        const auto& t = triangles[triangle];
        return {vertices[t[0]].cast<double>(), vertices[t[1]].cast<double>(),
                vertices[t[2]].cast<double>()};
    }

    /// What Embree found, made exact: its t is in single precision; the plane gives it in double.
    void setHit(std::optional<Hit>& out, const RTCRayHit& query, const Eigen::Vector3d& origin,
                const Eigen::Vector3d& direction) const {
        if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) {
            out.reset();
            return;
        }
        Hit& hit = out.emplace();
        hit.triangle = query.hit.primID;
        hit.u = query.hit.u;
        hit.v = query.hit.v;
        hit.t = static_cast<double>(query.ray.tfar);
        hit.normal = normals[hit.triangle];  // zero for a triangle without area
        const double slope = hit.normal.dot(direction);
        if (slope * slope > 1e-12 * direction.squaredNorm()) {
            const Eigen::Vector3d corner = vertices[triangles[hit.triangle][0]].cast<double>();
            hit.t = hit.normal.dot(corner - origin) / slope;
        }
    }

    std::vector<Eigen::Vector3d> normals;  ///< a triangle
    std::vector<Eigen::Vector3f> vertices;
    std::vector<std::array<std::uint32_t, 3>> triangles;
    RTCDevice device = nullptr;
    RTCScene scene = nullptr;
};

RayCaster::RayCaster(const TriangleMesh& mesh) {
    validate(mesh, "mesh");
    scene_ = std::make_unique<Scene>(mesh);
}
RayCaster::~RayCaster() = default;
RayCaster::RayCaster(RayCaster&&) noexcept = default;
RayCaster& RayCaster::operator=(RayCaster&&) noexcept = default;

std::optional<Hit> RayCaster::cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                   double tMax) const {
    RTCIntersectContext context{};
    rtcInitIntersectContext(&context);
    RTCRayHit query;
    setQuery(query, origin, direction, tMax);
    rtcIntersect1(scene_->scene, &context, &query);
    std::optional<Hit> hit;
    scene_->setHit(hit, query, origin, direction);
    return hit;
}

void RayCaster::castBundle(const Eigen::Vector3d& origin,
                           std::span<const Eigen::Vector3d> directions,
                           std::span<std::optional<Hit>> hits) const {
    constexpr std::size_t kMost = 256;
    std::array<RTCRayHit, kMost> queries;  // 20 kB: stays in the cache of a core
    RTCIntersectContext context{};
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    for (std::size_t begin = 0; begin < directions.size(); begin += kMost) {
        const std::size_t count = std::min(kMost, directions.size() - begin);
        for (std::size_t i = 0; i < count; ++i) {
            setQuery(queries[i], origin, directions[begin + i],
                     std::numeric_limits<double>::infinity());
        }
        rtcIntersect1M(scene_->scene, &context, queries.data(), static_cast<unsigned>(count),
                       sizeof(RTCRayHit));
        for (std::size_t i = 0; i < count; ++i) {
            scene_->setHit(hits[begin + i], queries[i], origin, directions[begin + i]);
        }
    }
}

bool RayCaster::occluded(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double margin) const {
    const Eigen::Vector3d d = b - a;
    const double length = d.norm();
    if (length <= 2 * margin) {
        return false;
    }
    RTCIntersectContext context{};
    rtcInitIntersectContext(&context);
    RTCRay ray;
    setRay(ray, a, d, margin / length, 1 - margin / length);
    rtcOccluded1(scene_->scene, &context, &ray);
    return ray.tfar < 0;
}

namespace {

/// What the callback of a point query needs and finds.
template <class SceneT>
struct Search {
    const SceneT& scene;
    Eigen::Vector3d a, b;  ///< the segment; a == b for a point
    double best = 0;       ///< [m]
    double slack = 0;      ///< radius of the query beyond `best`
    std::optional<std::uint32_t> triangle;
    Eigen::Vector3d point;
};

template <class SceneT>
bool visitPoint(RTCPointQueryFunctionArguments* arguments) {
    auto& search = *static_cast<Search<SceneT>*>(arguments->userPtr);
    const Triangle c = search.scene.corners(arguments->primID);
    const Eigen::Vector3d p = closestPoint(search.a, c);
    const double distance = (p - search.a).norm();
    // Of equally near triangles the first in the file, whatever the order of the tree.
    if (distance < search.best ||
        (distance == search.best && search.triangle && arguments->primID < *search.triangle)) {
        search.best = distance;
        search.triangle = arguments->primID;
        search.point = p;
        arguments->query->radius = static_cast<float>(distance + search.slack);
        return true;
    }
    return false;
}

template <class SceneT>
bool visitSegment(RTCPointQueryFunctionArguments* arguments) {
    auto& search = *static_cast<Search<SceneT>*>(arguments->userPtr);
    const double distance =
        segmentDistance(search.a, search.b, search.scene.corners(arguments->primID));
    if (distance < search.best) {
        search.best = distance;
        arguments->query->radius = static_cast<float>(distance + search.slack);
        return true;
    }
    return false;
}

/// Queries are rounded to single precision: they look this much farther than asked [m].
double roundingOf(const Eigen::Vector3d& p) {
    return 1e-6 * (1 + p.cwiseAbs().maxCoeff());
}

RTCPointQuery makeQuery(const Eigen::Vector3d& p, double radius) {
    RTCPointQuery query{};
    query.x = static_cast<float>(p.x());
    query.y = static_cast<float>(p.y());
    query.z = static_cast<float>(p.z());
    query.time = 0;
    query.radius = static_cast<float>(radius);
    return query;
}

}  // namespace

std::optional<Closest> RayCaster::closest(const Eigen::Vector3d& point, double maxDistance) const {
    const double slack = roundingOf(point);
    RTCPointQueryContext context{};
    rtcInitPointQueryContext(&context);
    RTCPointQuery query = makeQuery(point, maxDistance + slack);
    Search<Scene> search{*scene_, point, point, maxDistance, slack, std::nullopt, point};
    rtcPointQuery(scene_->scene, &query, &context, visitPoint<Scene>, &search);
    if (!search.triangle) {
        return std::nullopt;
    }
    return Closest{search.point, search.best, *search.triangle};
}

double RayCaster::sweptDistance(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                double maxDistance) const {
    const double length = (b - a).norm();
    // Short pieces keep the balls of the queries small.
    const int pieces = std::max(1, static_cast<int>(std::ceil(length / (4 * maxDistance + 1e-3))));
    double best = maxDistance;
    for (int i = 0; i < pieces && best > 0; ++i) {
        const Eigen::Vector3d p = a + (b - a) * (static_cast<double>(i) / pieces);
        const Eigen::Vector3d q = a + (b - a) * (static_cast<double>(i + 1) / pieces);
        const Eigen::Vector3d middle = (p + q) / 2;
        const double slack = (q - p).norm() / 2 + roundingOf(middle);
        RTCPointQueryContext context{};
        rtcInitPointQueryContext(&context);
        RTCPointQuery query = makeQuery(middle, best + slack);
        Search<Scene> search{*scene_, p, q, best, slack, std::nullopt, p};
        rtcPointQuery(scene_->scene, &query, &context, visitSegment<Scene>, &search);
        best = search.best;
    }
    return best;
}

bool RayCaster::sweptClear(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                           double clearance) const {
    return sweptDistance(a, b, clearance) >= clearance;
}

}  // namespace riftmap
