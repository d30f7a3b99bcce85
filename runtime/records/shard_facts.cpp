// SPDX-License-Identifier: Apache-2.0
#include "runtime/records/shard_facts.h"

#include <gsc/error.h>

namespace gsc {

void describe(const Record& at, ShardFacts& facts)
{
    at.field("index", facts.index, kCount);
    at.field("count", facts.count, kCount);
    at.check("index", facts.index >= 1 && facts.index <= facts.count, "a whole number from 1 to count");
    at.field("task", facts.task, kCount);
    at.field("tasks", facts.tasks, kCount);
    at.check("task", facts.task < facts.tasks, "a whole number below tasks");
    at.field("model", facts.model, kName);
    at.field("set", facts.set, kName);
}

std::string withShard(std::string_view line, const ShardFacts& facts)
{
    OrderedJson json;
    ShardFacts written = facts;
    describe(Record(json), written);
    std::string text(line.substr(0, line.rfind('}')));
    return text + ",\"shard\":" + jsonText(json, -1) + "}";
}

std::string hashText(uint64_t hash)
{
    return formatString("%016llx", static_cast<unsigned long long>(hash));
}

} // namespace gsc
