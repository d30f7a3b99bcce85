// SPDX-License-Identifier: Apache-2.0
#include "convert/chart/script_engine.h"

#include <gsc/error.h>

#include <duktape.h>

namespace gsc {

namespace {

// Throws for a failed call. The script's error, usually an Error object, is on top of the stack.
[[noreturn]] void throwScriptError(duk_context* context, const char* name)
{
    const std::string message = duk_safe_to_string(context, -1);
    duk_pop(context);
    if (message.find("alloc failed") != message.npos)
        throw Error(ErrorCode::OutOfMemory, name, "the script engine ran out of memory", "enough for every run",
                    "chart fewer runs at a time, or leave --figures out");
    throw internalError(name, "the script failed (" + message + ")", "it to draw");
}

struct Call {
    const char* function;
    std::string_view argument;
};

// Runs inside duk_safe_call, which turns every failure, also for lack of memory, into a code. It jumps out, so no C++ object
// with a destructor may live here.
duk_ret_t callFunction(duk_context* context, void* data)
{
    const Call& call = *static_cast<const Call*>(data);
    duk_get_global_string(context, call.function);
    duk_push_lstring(context, call.argument.data(), call.argument.size());
    duk_call(context, 1);
    duk_require_string(context, -1);
    return 1;
}

duk_ret_t runScript(duk_context* context, void* data)
{
    const Call& script = *static_cast<const Call*>(data);
    duk_push_string(context, script.function); // file name in the engine's messages
    duk_compile_lstring_filename(context, DUK_COMPILE_EVAL, script.argument.data(), script.argument.size());
    duk_call(context, 0);
    return 1;
}

} // namespace

void ScriptEngine::Free::operator()(void* context) const
{
    duk_destroy_heap(static_cast<duk_context*>(context));
}

ScriptEngine::ScriptEngine() : m_context(duk_create_heap_default())
{
    if (!m_context)
        throw Error(ErrorCode::OutOfMemory, "the script engine", "no memory for it", "enough",
                    "close other programs, or leave --figures out");
}

void ScriptEngine::run(std::string_view script, const char* name)
{
    auto* context = static_cast<duk_context*>(m_context.get());
    Call call{name, script};
    if (duk_safe_call(context, runScript, &call, 0, 1) != DUK_EXEC_SUCCESS)
        throwScriptError(context, name);
    duk_pop(context);
}

std::string ScriptEngine::call(const char* function, std::string_view argument)
{
    auto* context = static_cast<duk_context*>(m_context.get());
    Call call{function, argument};
    if (duk_safe_call(context, callFunction, &call, 0, 1) != DUK_EXEC_SUCCESS)
        throwScriptError(context, function);
    duk_size_t length = 0;
    const char* text = duk_get_lstring(context, -1, &length);
    std::string result(text, length);
    duk_pop(context);
    return result;
}

} // namespace gsc
