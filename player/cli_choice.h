// SPDX-License-Identifier: Apache-2.0
// An option that takes one of a few words.
#pragma once

#include <CLI/CLI.hpp>

#include <map>
#include <string>
#include <utility>

namespace gsc {

template <typename Value>
CLI::Option* addChoice(CLI::App& app, const std::string& name, Value& field, std::map<std::string, Value> choices,
                       const std::string& help)
{
    const auto choose = [name, &field, choices = std::move(choices)](const std::string& word) {
        const auto found = choices.find(word);
        if (found == choices.end()) {
            std::string known;
            for (const auto& [choice, value] : choices)
                known += (known.empty() ? "" : ", ") + choice;
            throw CLI::ValidationError(name, "\"" + word + "\" is none of " + known);
        }
        field = found->second;
    };
    return app.add_option_function<std::string>(name, choose, help);
}

} // namespace gsc
