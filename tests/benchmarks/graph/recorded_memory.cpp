// SPDX-License-Identifier: BSD-3-Clause
#include "recorded_memory.h"

#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <vector>

#include "riftmap/apps/importers.h"
#include "riftmap/apps/rawlog_reader.h"
#include "riftmap/graph/pixel_graph.h"
#include "riftmap/planner/paper_planner.h"
#include "riftmap/stereo/view_builder.h"

namespace riftmap {
namespace {

void importRecording(const std::string& kind, const std::filesystem::path& folder,
                     const std::filesystem::path& rawlog) {
    RawlogWriter writer(rawlog);
    const auto quiet = [](std::size_t, std::size_t) {};
    if (kind == "kitti") {
        importKitti(folder, {}, writer, quiet);
    } else {
        importEuroc(folder, writer, quiet);
    }
    writer.finish();
}

double median(std::vector<double> v) {
    std::sort(v.begin(), v.end());
    return v.empty() ? 0.0 : v[v.size() / 2];
}

}  // namespace

double residentBytes() {
    malloc_trim(0);
    std::ifstream statm("/proc/self/statm");
    double total = 0, resident = 0;
    statm >> total >> resident;
    return resident * static_cast<double>(::sysconf(_SC_PAGESIZE));
}

RecordedMemory recordedMemory(const std::string& kind, const std::filesystem::path& folder,
                              const std::filesystem::path& config, double blockSize) {
    const std::filesystem::path rawlog = std::filesystem::temp_directory_path() /
                                         ("bench-graph-" + std::to_string(::getpid()) + ".rawlog");
    importRecording(kind, folder, rawlog);
    RawlogOptions input;
    StereoOptions stereo;
    GraphOptions options;
    PaperPlannerOptions planner;  // its sections are in the file, too
    OptionTable table;
    input.describe(table);
    stereo.describe(table);
    options.describe(table);
    planner.describe(table);
    table.load(config.string());
    if (blockSize > 0) {
        options.blockSize = blockSize;
    }

    RecordedMemory result;
    PixelGraph graph(options);
    std::vector<double> merging, finding;
    {
        RawlogReader reader(rawlog, input);
        ViewBuilder builder(stereo);
        while (const auto observation = reader.next()) {
            const View view = builder.build(*observation);
            const auto start = std::chrono::steady_clock::now();
            graph.merge(view);
            const auto merged = std::chrono::steady_clock::now();
            graph.rifts();
            const auto found = std::chrono::steady_clock::now();
            merging.push_back(std::chrono::duration<double, std::milli>(merged - start).count());
            finding.push_back(std::chrono::duration<double, std::milli>(found - merged).count());
            ++result.views;
        }
    }
    std::filesystem::remove(rawlog);
    result.mergeMs = median(merging);
    result.riftsMs = median(finding);
    result.vertices = graph.vertexCount();
    result.countedBytes = static_cast<double>(graph.memoryBytes());
    const double all = residentBytes();
    graph.releaseBuffers();
    const double map = residentBytes();
    graph.clear();
    result.bufferBytes = all - map;
    result.mapBytes = map - residentBytes();
    return result;
}

}  // namespace riftmap
