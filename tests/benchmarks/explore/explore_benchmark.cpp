// SPDX-License-Identifier: BSD-3-Clause
// The table of exploring runs: worlds, noises, planners, starts. Rows
// WORLD.NOISE.PLANNER.START.FIGURE go to the CSV as each run ends; a run whose rows are there
// already is not done again, so that the table can be made in parts.
//
//   bench-explore --csv FILE [--only TEXT] [--list] [--keep DIR]
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "riftmap/apps/explore_program.h"
#include "riftmap/core/csv.h"

namespace {

namespace fs = std::filesystem;

struct Run {
    std::string name;  ///< WORLD.NOISE.PLANNER.START
    std::vector<std::string> arguments;
    double minutes = 0;  ///< on two cores, about
};

struct World {
    std::string name, config;
    std::vector<std::string> sets;
    std::vector<std::string> noises;
    bool object;
    double minutes;  ///< of one run at N0
};

std::string dataFolder() {
    const char* folder = std::getenv("RIFTMAP_DATA");
    return folder != nullptr ? folder : std::string(RIFTMAP_SOURCE_DIR) + "/../shared/data";
}

std::vector<World> worlds() {
    const std::string data = dataFolder();
    const auto object = [&](const std::string& name, const std::string& file) {
        return World{name,
                     "explore-object.ini",
                     {"World.mesh=" + data + "/objects/" + file, "World.size=1.0"},
                     {"N0", "N3", "N4"},
                     true,
                     0.3};
    };
    std::vector<World> all = {
        {"room", "explore-room.ini", {}, {"N0", "N4"}, false, 1.5},
        object("bunny", "stanford_bunny_35k.obj"),
        object("dragon", "stanford_dragon_res3.ply"),
        {"sculpture", "explore-sculpture.ini", {}, {"N0"}, true, 0.5},
        {"rooms", "explore-indoor.ini", {}, {"N0"}, false, 4},
        {"small_house",
         "explore-indoor.ini",
         {"World.mesh=" + data + "/world_aws_small_house/aws_small_house.obj",
          "Eval.samples=300000"},
         {"N0"},
         false,
         9},
        {"courtyard", "explore-courtyard.ini", {}, {"N4"}, false, 6},
    };
    std::erase_if(all, [&](const World& w) {
        for (const std::string& set : w.sets) {
            const std::string key = "World.mesh=";
            if (set.rfind(key, 0) == 0 && !fs::exists(set.substr(key.size()))) {
                std::printf("SKIPPED: %s, there is no %s\n", w.name.c_str(),
                            set.substr(key.size()).c_str());
                return true;
            }
        }
        return false;
    });
    return all;
}

std::vector<Run> runs(const std::string& keep) {
    std::vector<Run> table;
    const auto add = [&](const World& w, const std::string& noise, const std::string& planner,
                         int start) {
        Run run;
        run.name = w.name + "." + noise + "." + planner + "." + std::to_string(start);
        run.arguments = {std::string(RIFTMAP_SOURCE_DIR) + "/config/" + w.config,
                         "--set",
                         "Noise.level=" + noise,
                         "--set",
                         "Explore.planner=" + planner,
                         "--set",
                         "Platform.start_index=" + std::to_string(start),
                         "--set",
                         "Eval.cache=" + keep + "/observable",
                         "--set",
                         "Explore.rawlog=false",
                         "--seed",
                         std::to_string(start),
                         "--no-progress",
                         "-w",
                         "--out",
                         keep + "/" + run.name};
        for (const std::string& set : w.sets) {
            run.arguments.insert(run.arguments.end(), {"--set", set});
        }
        if (planner != "riftmap") {  // no planner but ours knows when it is done
            const std::string views = w.object ? "30" : "150";
            run.arguments.insert(run.arguments.end(), {"--set", "Stop.max_views=" + views});
        }
        if (planner == "paper") {
            run.arguments.insert(run.arguments.end(), {"--set", "Graph.typed_openness=false"});
        }
        run.minutes = w.minutes * (noise == "N4" ? 2 : 1);
        table.push_back(std::move(run));
    };
    for (const World& w : worlds()) {
        for (const std::string& noise : w.noises) {
            for (int start = 0; start < 3; ++start) {
                add(w, noise, "riftmap", start);
            }
        }
    }
    for (const World& w : worlds()) {
        const bool compared =
            w.name == "room" || w.name == "rooms" || w.name == "bunny" || w.name == "dragon";
        for (int start = 0; compared && start < 3; ++start) {
            add(w, "N0", "paper", start);
            add(w, "N0", w.object ? "sphere" : "octomap_frontier", start);
            add(w, "N0", "random", start);
            if (!w.object) {
                add(w, "N0", "foresight", start);
            }
        }
    }
    return table;
}

/// `key: value` lines.
std::map<std::string, std::string> readSummary(const fs::path& file) {
    std::map<std::string, std::string> values;
    std::ifstream in(file);
    for (std::string line; std::getline(in, line);) {
        const auto colon = line.find(": ");
        if (colon != std::string::npos) {
            values[line.substr(0, colon)] = line.substr(colon + 2);
        }
    }
    return values;
}

void writeRows(riftmap::CsvWriter& csv, const std::string& run, const fs::path& directory,
               double seconds) {
    const auto summary = readSummary(directory / "summary.yaml");
    const auto put = [&](const std::string& figure, const std::string& key) {
        const auto it = summary.find(key);
        if (it != summary.end()) {
            csv.row({run + "." + figure, it->second});
        }
    };
    for (const char* delta : {"2mm", "5mm", "1cm", "2cm", "5cm", "10cm"}) {
        put(std::string("c_obs_") + delta, std::string("c_obs_") + delta);
        put(std::string("c_all_") + delta, std::string("c_all_") + delta);
        put(std::string("accuracy_") + delta, std::string("accuracy_") + delta);
    }
    put("views", "views");
    put("path_m", "path_length_m");
    put("views_to_95", "views_to_95");
    put("path_to_95", "path_to_95_m");
    put("plan_ms_median", "plan_ms_median");
    put("plan_ms_p95", "plan_ms_p95");
    put("accuracy", "accuracy_headline");
    put("explained", "explained");
    put("verdicts", "certificate_verdicts");
    put("verdicts_right", "certificate_right");
    put("collisions", "collisions");
    put("auc_10", "auc_10");
    put("stop_reason", "stop_reason");
    csv.row({run + ".wall_s", seconds});
}

}  // namespace

int main(int argc, char** argv) {
    std::string csvFile = "explore.csv";
    std::string only;
    std::string keep;
    bool list = false;
    for (int i = 1; i < argc; ++i) {
        const auto value = [&] { return i + 1 < argc ? argv[++i] : ""; };
        if (std::strcmp(argv[i], "--csv") == 0) {
            csvFile = value();
        } else if (std::strcmp(argv[i], "--only") == 0) {
            only = value();
        } else if (std::strcmp(argv[i], "--keep") == 0) {
            keep = value();
        } else if (std::strcmp(argv[i], "--list") == 0) {
            list = true;
        } else {
            std::fprintf(stderr,
                         "bench-explore: unknown argument '%s'; known: --csv FILE, --only TEXT, "
                         "--keep DIR, --list\n",
                         argv[i]);
            return 2;
        }
    }
    if (keep.empty()) {
        keep = (fs::path(csvFile).parent_path() / "explore").string();
    }
    std::set<std::string> done;
    if (fs::exists(csvFile)) {
        for (const auto& row : riftmap::readCsv(csvFile).rows) {
            const std::string suffix = ".wall_s";  // the last row of a run
            if (row[0].size() > suffix.size() &&
                row[0].compare(row[0].size() - suffix.size(), suffix.size(), suffix) == 0) {
                done.insert(row[0].substr(0, row[0].size() - suffix.size()));
            }
        }
    }
    std::vector<Run> table = runs(keep);
    std::erase_if(table, [&](const Run& r) {
        return done.count(r.name) != 0 || r.name.find(only) == std::string::npos;
    });
    double minutes = 0;
    for (const Run& r : table) {
        minutes += r.minutes;
        if (list) {
            std::printf("%s\n", r.name.c_str());
        }
    }
    std::printf("%zu runs, about %.0f minutes on two cores\n", table.size(), minutes);
    std::fflush(stdout);
    if (list) {
        return EXIT_SUCCESS;
    }
    fs::create_directories(keep + "/observable");
    riftmap::CsvWriter csv(csvFile, {"name", "value"}, riftmap::CsvWriter::Mode::kAppend);
    int failed = 0;
    for (const Run& r : table) {
        const auto start = std::chrono::steady_clock::now();
        riftmap::ExploreProgram program;
        const int code = riftmap::runProgram(program, r.arguments);
        const double seconds =
            std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        const fs::path directory = fs::path(keep) / r.name;
        if (fs::exists(directory / "summary.yaml")) {  // also after a collision: it is a figure
            writeRows(csv, r.name, directory, seconds);
        }
        failed += code == 0 ? 0 : 1;
        std::printf("%s: exit %d, %zu views, %.1f m, %s, %.0f s\n", r.name.c_str(), code,
                    program.views, program.pathLength, program.stopReason.c_str(), seconds);
        std::fflush(stdout);
    }
    return failed == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
