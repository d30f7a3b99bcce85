// SPDX-License-Identifier: Apache-2.0
#include "player/options/shard.h"

#include <gsc/error.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <numeric>
#include <optional>
#include <string_view>

namespace gsc {

namespace {

constexpr uint64_t kMaxShards = 1000000;

std::optional<uint64_t> wholeOf(std::string_view text)
{
    uint64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty() || error != std::errc() || end != text.data() + text.size())
        return std::nullopt;
    return value;
}

[[noreturn]] void failShard(const std::string& option, const std::string& text)
{
    throw Error(ErrorCode::Usage, formatString("%s %.80s", option.c_str(), text.c_str()), "no part of a whole",
                formatString("I/N with I from 1 to N and N at most %llu, such as 1/4, or auto or auto/N",
                             static_cast<unsigned long long>(kMaxShards)),
                "correct it or leave " + option + " out");
}

// Reads a whole number from an environment variable; none if it is not set or empty. Throws Error(Usage) for any other
// text.
std::optional<uint64_t> variable(const Environment& environment, const char* name)
{
    const char* const text = environment(name);
    if (text == nullptr || *text == 0)
        return std::nullopt;
    const std::optional<uint64_t> value = wholeOf(text);
    if (!value)
        throw Error(ErrorCode::Usage, name, formatString("is \"%.40s\"", text), "a whole number",
                    "correct it or pass --shard I/N");
    return value;
}

// A program that starts many processes, and the environment variables in which it tells each its number.
struct Starter {
    const char* index;
    uint64_t place; // number of this process, from 0
    std::optional<uint64_t> count;
};

// Reads the variables of a Slurm job array. An array's numbers may start anywhere and have a step, but each must be
// the number of one part.
std::optional<Starter> slurm(const Environment& environment)
{
    const std::optional<uint64_t> id = variable(environment, "SLURM_ARRAY_TASK_ID");
    const std::optional<uint64_t> count = variable(environment, "SLURM_ARRAY_TASK_COUNT");
    if (!id)
        return std::nullopt;
    if (!count)
        throw Error(ErrorCode::Usage, "--shard auto", "SLURM_ARRAY_TASK_ID is set and SLURM_ARRAY_TASK_COUNT is not",
                    "both, as sbatch --array sets them", "pass --shard I/N");
    const uint64_t first = variable(environment, "SLURM_ARRAY_TASK_MIN").value_or(0);
    const uint64_t step = std::max<uint64_t>(1, variable(environment, "SLURM_ARRAY_TASK_STEP").value_or(1));
    const uint64_t last = variable(environment, "SLURM_ARRAY_TASK_MAX").value_or(first + (*count - 1) * step);
    if (*id < first || (*id - first) % step != 0 || (*id - first) / step >= *count ||
        last != first + (*count - 1) * step)
        throw Error(ErrorCode::Usage, "--shard auto",
                    formatString("task %llu of a Slurm array of %llu from %llu to %llu by %llu",
                                 static_cast<unsigned long long>(*id), static_cast<unsigned long long>(*count),
                                 static_cast<unsigned long long>(first), static_cast<unsigned long long>(last),
                                 static_cast<unsigned long long>(step)),
                    "an array without gaps such as --array=1-4", "pass --shard I/N");
    return Starter{"SLURM_ARRAY_TASK_ID", (*id - first) / step, count};
}

std::vector<Starter> startersOf(const Environment& environment, bool ranks_are_devices)
{
    std::vector<Starter> found;
    if (const std::optional<Starter> array = slurm(environment))
        found.push_back(*array);
    const std::optional<uint64_t> rank = variable(environment, "OMPI_COMM_WORLD_RANK");
    const std::optional<uint64_t> size = variable(environment, "OMPI_COMM_WORLD_SIZE");
    if (rank && size && !ranks_are_devices)
        found.push_back({"OMPI_COMM_WORLD_RANK", *rank, size});
    if (const std::optional<uint64_t> index = variable(environment, "JOB_COMPLETION_INDEX"))
        found.push_back({"JOB_COMPLETION_INDEX", *index, std::nullopt});
    return found;
}

// Finds the shard from the environment. `stated` is the N of auto/N.
Shard automaticShard(const std::string& text, std::optional<uint64_t> stated, const Environment& environment,
                     bool ranks_are_devices)
{
    const std::vector<Starter> found = startersOf(environment, ranks_are_devices);
    if (found.empty() && ranks_are_devices)
        throw Error(ErrorCode::Usage, "--shard " + text,
                    formatString("the ranks of this MPI job are devices of one run, and neither SLURM_ARRAY_TASK_ID "
                                 "(Slurm) nor%s JOB_COMPLETION_INDEX (Kubernetes) is set",
                                 stated ? "" : ", for auto/N,"),
                    "one of them", "pass --shard I/N, or start gsc-play by mpirun for a part to each rank");
    if (found.empty())
        throw Error(ErrorCode::Usage, "--shard " + text,
                    formatString("none of SLURM_ARRAY_TASK_ID with SLURM_ARRAY_TASK_COUNT (Slurm), "
                                 "OMPI_COMM_WORLD_RANK with OMPI_COMM_WORLD_SIZE (Open MPI)%s is set",
                                 stated ? " and JOB_COMPLETION_INDEX (Kubernetes)" : ""),
                    "one of them", "start it by sbatch --array or mpirun, or pass --shard I/N");
    if (found.size() > 1)
        throw Error(ErrorCode::Usage, "--shard " + text,
                    formatString("both %s and %s are set", found[0].index, found[1].index),
                    "one of them to say which part this is", "pass --shard I/N");
    const Starter& starter = found.front();
    if (!starter.count && !stated)
        throw Error(ErrorCode::Usage, "--shard auto",
                    formatString("%s is %llu and nothing says of how many", starter.index,
                                 static_cast<unsigned long long>(starter.place)),
                    "their number", "pass --shard auto/N with the completions of the job");
    const uint64_t count = starter.count.value_or(stated.value_or(0));
    if (stated && count != *stated) // for instance if one task of a job array was submitted again by itself
        throw Error(ErrorCode::Usage, "--shard " + text,
                    formatString("%s is one of %llu", starter.index, static_cast<unsigned long long>(count)),
                    formatString("one of %llu", static_cast<unsigned long long>(*stated)),
                    "start as many, or pass --shard I/N");
    if (count < 1 || count > kMaxShards || starter.place >= count)
        throw Error(ErrorCode::Usage, "--shard " + text,
                    formatString("%s is number %llu of %llu", starter.index,
                                 static_cast<unsigned long long>(starter.place),
                                 static_cast<unsigned long long>(count)),
                    formatString("less than that, and at most %llu", static_cast<unsigned long long>(kMaxShards)),
                    "pass --shard I/N");
    return {starter.place + 1, count};
}

} // namespace

std::string Shard::text() const
{
    return formatString("%llu/%llu", static_cast<unsigned long long>(index), static_cast<unsigned long long>(count));
}

const char* processEnvironment(const char* name)
{
    return std::getenv(name);
}

Shard parseShard(const std::string& text, const std::string& option, const Environment& environment,
                 bool ranks_are_devices)
{
    if (text == "auto")
        return automaticShard(text, std::nullopt, environment, ranks_are_devices);
    const size_t slash = text.find('/');
    if (slash == std::string::npos)
        failShard(option, text);
    const std::optional<uint64_t> count = wholeOf(std::string_view(text).substr(slash + 1));
    if (!count || *count < 1 || *count > kMaxShards)
        failShard(option, text);
    if (text.substr(0, slash) == "auto")
        return automaticShard(text, count, environment, ranks_are_devices);
    const std::optional<uint64_t> index = wholeOf(std::string_view(text).substr(0, slash));
    if (!index || *index < 1 || *index > *count)
        failShard(option, text);
    return {*index, *count};
}

bool takesTask(const Shard& shard, uint64_t task)
{
    return !shard.isGiven() || task % shard.count == shard.index - 1;
}

std::vector<uint64_t> blockShards(const std::vector<uint64_t>& weights, uint64_t count)
{
    // each shard has an equal share of the total weight; a task belongs to the shard in whose share the task's middle
    // lies
    const double all = std::max(1.0, double(std::accumulate(weights.begin(), weights.end(), uint64_t(0))));
    std::vector<uint64_t> shards;
    uint64_t before = 0;
    for (const uint64_t weight : weights) {
        const double middle = (double(before) + double(weight) / 2) / all;
        shards.push_back(std::min(count - 1, uint64_t(middle * double(count))));
        before += weight;
    }
    return shards;
}

} // namespace gsc
