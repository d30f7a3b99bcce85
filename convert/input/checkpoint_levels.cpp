// SPDX-License-Identifier: Apache-2.0
// Reads how a model chooses its level of detail: the rule, the range of levels and the unit of distance.
#include "convert/input/checkpoint_model.h"

#include "convert/input/model_names.h"
#include <gsc/error.h>
#include <gsc/interrupt.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

namespace gsc {

namespace {

struct LevelRange {
    int32_t least = kMaxAnchorLevel, greatest = 0;
};

// Finds the range of levels by a pass over the whole file: the trainer's rule limits a level to those that the anchors
// have.
LevelRange scanLevels(const Checkpoint& checkpoint)
{
    constexpr size_t kBatchRows = 8192;
    LevelRange range;
    AnchorBatch batch;
    const std::unique_ptr<AnchorSource> anchors = openAnchors(checkpoint);
    while (anchors->next(batch, kAnchorPlacement, kBatchRows)) {
        throwIfInterrupted();
        const auto [least, greatest] = std::minmax_element(batch.level.begin(), batch.level.end());
        range = {std::min(range.least, *least), std::max(range.greatest, *greatest)};
    }
    return range;
}

constexpr int kLeastFork = 2, kMostFork = 64;

LevelRule parseRule(const std::string& name, const std::string& path)
{
    for (const LevelRule rule : {LevelRule::Floor, LevelRule::Round, LevelRule::Ceil, LevelRule::Progressive})
        if (name == kLevelRuleNames[uint32_t(rule)])
            return rule;
    throw Error(ErrorCode::Unsupported, path, "dist2level is '" + name.substr(0, 32) + "'",
                "floor, round, ceil or progressive", "train with one of them");
}

LevelRule readRule(const ConfigFile& config, int option, Checkpoint& checkpoint)
{
    const std::string key = config.modelKey("dist2level");
    if (config.values.states(key)) {
        const LevelRule stated = parseRule(config.values.getString(key, "", config.path), config.path);
        if (option >= 0 && LevelRule(option) != stated)
            throw Error(ErrorCode::Usage, config.path,
                        std::string("dist2level is '") + kLevelRuleNames[uint32_t(stated)] + "'",
                        std::string("what --dist2level ") + kLevelRuleNames[option] + " says", "leave the option out");
        return stated;
    }
    if (option >= 0)
        return LevelRule(option);
    checkpoint.warnings.push_back(checkpoint.model_path + ": no cfg_args states dist2level, upstream's default 'round' "
                                                          "is taken; pass --dist2level if the model was trained with "
                                                          "another");
    return LevelRule::Round;
}

uint32_t readFork(const ConfigFile& config, int option, Checkpoint& checkpoint)
{
    const std::string key = config.modelKey("fork");
    if (config.values.states(key)) {
        const double stated = config.values.getNumber(key, 0, config.path);
        if (!(stated >= kLeastFork && stated <= kMostFork) || stated != std::floor(stated))
            throw Error(ErrorCode::Unsupported, config.path, formatString("fork is %g", stated),
                        formatString("a whole number from %d to %d", kLeastFork, kMostFork), "train with one");
        if (option != 0 && option != stated)
            throw Error(ErrorCode::Usage, config.path, formatString("fork is %g", stated),
                        formatString("what --fork %d says", option), "leave the option out");
        return uint32_t(stated);
    }
    if (option != 0)
        return uint32_t(option);
    checkpoint.warnings.push_back(checkpoint.model_path + ": no cfg_args states fork, upstream's default 2 is taken; "
                                                          "pass --fork if the model was trained with another");
    return 2;
}

// Reads the column `info`, which holds voxel_size in row 0, standard_dist in row 1 and zeros elsewhere.
void readInfo(Checkpoint& checkpoint, const PlyFile& ply, const AnchorColumns& columns)
{
    const uint32_t row_bytes = ply.header().row_bytes;
    if (ply.header().row_count < 2)
        throw Error(ErrorCode::InvalidFile, ply.path(), "has one vertex",
                    "at least two, because the first two carry voxel_size and standard_dist",
                    "the model cannot be used");
    std::vector<std::byte> rows(2 * size_t(row_bytes));
    ply.readRows(0, rows);
    float info[2];
    for (size_t i = 0; i < 2; ++i)
        std::memcpy(&info[i], rows.data() + i * row_bytes + columns.info[0], sizeof(float));
    for (const float value : info)
        if (!(value > 0) || !std::isfinite(value))
            throw Error(ErrorCode::InvalidFile, ply.path(),
                        formatString("column 'info' starts with %g, %g", double(info[0]), double(info[1])),
                        "voxel_size and standard_dist, both positive",
                        "the vertices were sorted, filtered or merged, pass the PLY as the trainer wrote it");
    checkpoint.voxel_size = info[0];
    checkpoint.standard_dist = info[1];
}

// The number behind `key` in the obj_info lines of the PLY. It has six decimals; the trainer's loader uses it too, so
// we need no more.
double headerNumber(const PlyFile& ply, const std::string& key)
{
    for (const std::string& line : ply.header().obj_info)
        if (line.starts_with(key + " ")) {
            char* end = nullptr;
            const double value = std::strtod(line.c_str() + key.size() + 1, &end);
            if (end != line.c_str() + key.size() + 1 && std::isfinite(value) && value > 0)
                return value;
        }
    throw Error(ErrorCode::InvalidFile, ply.path(), "header has no 'obj_info " + key + " <positive number>'",
                "it beside the column 'level'", "pass the PLY as the trainer wrote it");
}

// Highest level that Octree-AnyGS draws. It trains from coarse to fine and draws only the levels that it had reached at
// `iteration`.
int32_t coarseLimit(const Checkpoint& checkpoint, int32_t levels, const ConfigFile& config,
                    std::vector<std::string>& warnings)
{
    if (!config.values.getBool(config.modelKey("progressive"), false, config.path))
        return levels - 1;
    if (checkpoint.iteration < 0 || !config.optim.find("coarse_iter")) {
        warnings.push_back(checkpoint.model_path + ": trained coarse to fine, but the iteration or config.yaml is "
                                                   "unknown; taken as trained to the end");
        return levels - 1;
    }
    const double stated = config.values.getNumber(config.modelKey("init_level"), -1, config.path);
    const int32_t init_level = stated >= 0 && stated < 64 ? int32_t(stated) : levels / 2;
    const double first_iteration = config.optim.getNumber("coarse_iter", 10000, config.path);
    const double q = 1.0 / config.optim.getNumber("coarse_factor", 1.5, config.path);
    const int32_t steps = levels - 1 - init_level;
    // the iterations at which a level is added form a geometric series, which ends at coarse_iter
    int32_t reached = 0;
    double end = 0;
    for (int32_t i = 0; i < steps; ++i) {
        end += first_iteration * (1 - q) / (1 - std::pow(q, steps)) * std::pow(q, i);
        reached += end < checkpoint.iteration;
    }
    return reached + init_level;
}

} // namespace

void readLevels(Checkpoint& checkpoint, const PlyFile& ply, const AnchorColumns& columns, const ConfigFile& config,
                const CheckpointOptions& options)
{
    if (options.fork != 0 && (options.fork < kLeastFork || options.fork > kMostFork))
        throw Error(ErrorCode::Usage, "--fork", formatString("is %d", options.fork),
                    formatString("a whole number from %d to %d", kLeastFork, kMostFork), "correct it or leave it out");
    if (columns.level.empty()) {
        if (options.fork != 0 || options.level_rule >= 0 || options.add_level >= 0)
            throw Error(ErrorCode::Usage,
                        options.fork != 0         ? "--fork"
                        : options.level_rule >= 0 ? "--dist2level"
                                                  : "--add-level",
                        "has no effect on " + checkpoint.model_path + ", a model without levels", "one with levels",
                        "leave the option out");
        const double voxel = config.values.getNumber(config.modelKey("voxel_size"), 0, config.path);
        // 0 or less means that the trainer derived the size, and it stores the derived one nowhere
        checkpoint.voxel_size = voxel > 0 && std::isfinite(voxel) ? float(voxel) : 0.0f;
        return;
    }
    checkpoint.flags |= kModelHasLevels;
    checkpoint.level_rule = readRule(config, options.level_rule, checkpoint);
    checkpoint.fork = readFork(config, options.fork, checkpoint);
    const LevelRange range = scanLevels(checkpoint);
    checkpoint.level_min = range.least;
    if (checkpoint.family == ModelFamily::OctreeGs) {
        checkpoint.flags |= kModelLodHalfCell;
        readInfo(checkpoint, ply, columns);
        checkpoint.level_clamp = range.greatest - range.least;
    } else {
        checkpoint.standard_dist = float(headerNumber(ply, "standard_dist"));
        const double levels = headerNumber(ply, "levels");
        if (levels > kMaxAnchorLevel + 1 || levels < 0.5)
            throw Error(ErrorCode::InvalidFile, ply.path(), formatString("header states %g levels", levels),
                        formatString("1 to %d", kMaxAnchorLevel + 1), "the file is damaged, copy it again");
        checkpoint.level_clamp = coarseLimit(checkpoint, int32_t(std::lrint(levels)), config, checkpoint.warnings);
    }
    if (range.greatest > checkpoint.level_clamp)
        checkpoint.warnings.push_back(formatString("%s: levels above %d are in the file but can never be selected, as "
                                                   "in the trainer's own renderer",
                                                   ply.path().c_str(), checkpoint.level_clamp));
}

} // namespace gsc
