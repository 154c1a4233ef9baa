/* SPDX-License-Identifier: MIT
 * JSON Schema of the scene format, from the tables that the reader uses.
 */
#include "scene/tables.h"

#include <stdio.h>
#include <stdlib.h>

static json_t *numbers(int count) {
    return json_pack("{s:s s:{s:s} s:i s:i}", "type", "array", "items", "type", "number",
                     "minItems", count, "maxItems", count);
}

static json_t *table_to_schema(const key_table *table);

static void add_range(json_t *schema, const key *k) {
    if (k->lo == 0 && k->hi == 0) return;
    json_object_set_new(schema, "minimum", json_real(k->lo));
    if (k->hi < 1e30) json_object_set_new(schema, "maximum", json_real(k->hi));
}

static json_t *key_to_schema(const key *k) {
    json_t *s = NULL;
    switch (k->kind) {
    case KEY_REAL:
    case KEY_DEGREES:
        s = json_pack("{s:s}", "type", "number");
        break;
    case KEY_DOUBLE:
        s = json_pack("{s:[ss]}", "type", "number", "string");
        break;
    case KEY_INT:
    case KEY_INT32:
        s = json_pack("{s:s}", "type", "integer");
        break;
    case KEY_BOOL:
        s = json_pack("{s:s}", "type", "boolean");
        break;
    case KEY_NAME:
        s = json_pack("{s:s}", "type", "string");
        break;
    case KEY_VEC3:
        s = numbers(3);
        break;
    case KEY_QUAT:
    case KEY_TURN:
        s = numbers(4);
        break;
    case KEY_COLOR:
        s = json_pack("{s:s s:s}", "type", "string", "pattern",
                      "^#([0-9a-fA-F]{6}|[0-9a-fA-F]{8})$");
        break;
    case KEY_CHOICE:
        s = json_pack("{s:[]}", "enum");
        for (int i = 0; k->choices[i]; i++)
            json_array_append_new(json_object_get(s, "enum"), json_string(k->choices[i]));
        break;
    case KEY_OBJECT:
        s = table_to_schema(k->keys);
        break;
    case KEY_LIST:
        s = json_pack("{s:s s:o}", "type", "array", "items",
                      k->keys ? table_to_schema(k->keys) : numbers(3));
        break;
    case KEY_NAMES:
        s = json_pack("{s:s s:{s:s}}", "type", "array", "items", "type", "string");
        break;
    case KEY_MAP:
        s = json_pack("{s:s s:o}", "type", "object", "additionalProperties",
                      table_to_schema(k->keys));
        break;
    }
    if (!s) return NULL;
    if (k->kind <= KEY_INT32) add_range(s, k);
    char text[256];
    snprintf(text, sizeof text, "%s%s%s%s", k->doc, k->unit[0] ? " [" : "", k->unit,
             k->unit[0] ? "]" : "");
    if (text[0]) json_object_set_new(s, "description", json_string(text));
    return s;
}

static json_t *table_to_schema(const key_table *table) {
    json_t *properties = json_object();
    for (int i = 0; i < table->count; i++)
        json_object_set_new(properties, table->key[i].name, key_to_schema(&table->key[i]));
    return json_pack("{s:s s:b s:o}", "type", "object", "additionalProperties", 0, "properties",
                     properties);
}

char *jsl_scene_schema(void) {
    json_t *schema = table_to_schema(&table_root);
    if (!schema) return NULL;
    json_object_set_new(schema, "$schema",
                        json_string("https://json-schema.org/draft/2020-12/schema"));
    json_object_set_new(schema, "title", json_string("jostle scene"));
    char *text = json_dumps(schema, JSON_INDENT(2) | JSON_REAL_PRECISION(12));
    json_decref(schema);
    return text;
}
