// SPDX-License-Identifier: Apache-2.0
// A JavaScript engine (ES5, no DOM, no input or output) for scripts that are part of the program.
#pragma once

#include <memory>
#include <string>
#include <string_view>

namespace gsc {

class ScriptEngine {
public:
    ScriptEngine(); // throws Error(OutOfMemory)

    // Runs a script; `name` is for messages. Throws Error(Internal) with the script's own message, OutOfMemory.
    void run(std::string_view script, const char* name);
    // Calls a global function with one text, returns its text. Throws as run().
    std::string call(const char* function, std::string_view argument);

private:
    struct Free {
        void operator()(void* context) const;
    };
    std::unique_ptr<void, Free> m_context;
};

} // namespace gsc
